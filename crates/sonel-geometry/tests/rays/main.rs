//! Rays: none slips between walls, none is lost on a long walk, the index finds what an exhaustive search finds.

mod leaky;
mod numbers;
mod oracle;
mod rooms;
mod walks;
mod watertight;
