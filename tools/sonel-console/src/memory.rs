//! Memory that is not there ends a program in one message.
//!
//! Without this the standard library prints a message of its own and aborts, in whatever thread.

use std::alloc::{GlobalAlloc, Layout, System};

use crate::interrupt;

/// The system's allocator; what it refuses ends the program, once interruptions are handled ([`interrupt::remove_unfinished_files`]).
struct Ending;

/// Every program of this project allocates by it.
#[global_allocator]
static ALLOCATOR: Ending = Ending;

impl Ending {
    fn checked(memory: *mut u8, bytes: usize) -> *mut u8 {
        if memory.is_null() {
            interrupt::out_of_memory(bytes);
        }
        memory
    }
}

// SAFETY: all is left to the system's allocator, and null is returned as it returned it.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Ending {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the contract of the caller.
        Self::checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the contract of the caller.
        Self::checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the contract of the caller.
        Self::checked(unsafe { System.realloc(old, layout, size) }, size)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the contract of the caller.
        unsafe { System.dealloc(memory, layout) }
    }
}
