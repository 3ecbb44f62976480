//! Inspects maps and responses, reads room-acoustic parameters.
