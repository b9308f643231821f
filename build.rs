//! The commit of the build, so that every result can say what made it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    record_commit();
}

fn record_commit() {
    let manifest = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR"));
    let sources = ["src", "crates", "build.rs", "Cargo.toml", "Cargo.lock", ".cargo"];
    for path in sources {
        watch(&manifest.join(path));
    }

    let git = |arguments: &[&str]| run(Command::new("git").arg("-C").arg(&manifest).args(arguments));
    // An unpacked archive inside some other repository is not that repository's commit.
    let own = git(&["rev-parse", "--show-toplevel"])
        .is_some_and(|top| fs::canonicalize(top).ok() == fs::canonicalize(&manifest).ok());
    let commit = own.then(|| {
        for file in ["HEAD", "logs/HEAD", "packed-refs"]
            .map(str::to_owned)
            .into_iter()
            .chain(git(&["symbolic-ref", "-q", "HEAD"]))
        {
            if let Some(path) = git(&["rev-parse", "--git-path", &file]) {
                watch(&manifest.join(path));
            }
        }
        let mut commit = git(&["rev-parse", "--short", "HEAD"])?;
        let status: Vec<&str> = ["status", "--porcelain", "--"].into_iter().chain(sources).collect();
        if git(&status).is_none_or(|changes| !changes.is_empty()) {
            commit.push_str("+dirty");
        }
        Some(commit)
    });
    println!(
        "cargo:rustc-env=STICKSLIP_COMMIT={}",
        commit.flatten().as_deref().unwrap_or("unknown")
    );
}

/// Cargo reruns the script each time if a watched file does not exist.
fn watch(path: &Path) {
    if path.exists() {
        println!("cargo:rerun-if-changed={}", path.display());
    }
}

fn run(command: &mut Command) -> Option<String> {
    let output = command.output().ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
