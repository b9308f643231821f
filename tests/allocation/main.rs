//! What takes memory from the heap, by an allocator that counts. It is that of the whole program, which therefore holds nothing else.

#[path = "../common/mod.rs"]
mod common;

mod counting;
mod hostile_input;
mod steps;
