//! What depends on the machine: readers of result files, shells, small disks. A test that the machine cannot run reports itself as
//! ignored, with the reason; with STICKSLIP_IGNORE_NONE set, as failed.

#[path = "../common/mod.rs"]
mod common;

mod completions;
mod full_disk;
mod readers;

use libtest_mimic::Arguments;

fn main() {
    if full_disk::is_child() {
        return;
    }
    let mut tests = completions::tests();
    tests.extend(full_disk::tests());
    tests.extend(readers::tests());
    libtest_mimic::run(&Arguments::from_args(), tests).exit();
}
