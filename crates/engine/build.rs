//! Binds the parts of SUNDIALS that sundials-sys leaves out: it links ARKODE without bindings. Its types are used.
//!
//! The return flags become tables of names, read from the headers. The compiler's version is recorded for results.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex};
use std::{env, fs};

use bindgen::callbacks::{IntKind, ParseCallbacks};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let root = env::var_os("DEP_SUNDIALS_ROOT")
        .expect("sundials-sys reports its headers (DEP_SUNDIALS_ROOT) only with its feature build_libraries");
    bind_sundials(&PathBuf::from(root).join("include"), &out);
    name_compiler();
}

const HEADERS: &str = "\
#include <cvode/cvode.h>
#include <arkode/arkode_erkstep.h>
#include <arkode/arkode_arkstep.h>
";

fn bind_sundials(include: &Path, out: &Path) {
    let macros = Macros::default();
    let builder = bindgen::Builder::default()
        .header_contents("sundials_rest.h", HEADERS)
        .clang_arg(format!("-I{}", include.display()))
        .allowlist_function("ARKode.*|ARKStep.*|ERKStep.*")
        .blocklist_function(".*MRIStep.*")
        .allowlist_type("ARK.*")
        .allowlist_var("ARK_.*")
        // The other types come from sundials-sys.
        .allowlist_recursively(false)
        .raw_line("use sundials_sys::*;")
        .prepend_enum_name(false)
        .layout_tests(false)
        .formatter(bindgen::Formatter::None)
        .parse_callbacks(Box::new(macros.clone()));

    // bindgen loads libclang at run time, and panics if there is none.
    let bindings = std::panic::catch_unwind(AssertUnwindSafe(|| builder.generate())).unwrap_or_else(|_| {
        panic!(
            "bindgen found no libclang. Install it (Debian, Ubuntu: libclang-dev; Fedora: clang-devel; \
             Arch: clang; Homebrew: llvm), or set LIBCLANG_PATH to the folder of libclang.so"
        )
    });
    let bindings = bindings.expect("the ARKODE headers of sundials-sys can be parsed");
    // Edition 2024 wants `unsafe extern`.
    let bindings = bindings.to_string().replace("extern \"C\" {", "unsafe extern \"C\" {");
    fs::write(out.join("sundials_rest.rs"), bindings).expect("OUT_DIR is writable");

    let found = macros.0.lock().expect("bindgen runs on one thread");
    fs::write(out.join("sundials_flags.rs"), found.flags()).expect("OUT_DIR is writable");
    println!(
        "cargo:rustc-env=STICKSLIP_SUNDIALS_VERSION={}",
        found.version.as_deref().unwrap_or("unknown")
    );
}

#[derive(Debug, Default)]
struct Found {
    integers: BTreeMap<String, i64>,
    version: Option<String>,
}

#[derive(Clone, Debug, Default)]
struct Macros(Arc<Mutex<Found>>);

impl ParseCallbacks for Macros {
    fn int_macro(&self, name: &str, value: i64) -> Option<IntKind> {
        let mut found = self.0.lock().ok()?;
        found.integers.insert(name.to_owned(), value);
        // The flags and modes are `int` in every signature.
        (name.starts_with("ARK") || name.starts_with("CV")).then_some(IntKind::Int)
    }

    fn str_macro(&self, name: &str, value: &[u8]) {
        if name == "SUNDIALS_VERSION"
            && let Ok(mut found) = self.0.lock()
        {
            found.version = Some(String::from_utf8_lossy(value).into_owned());
        }
    }
}

impl Found {
    fn flags(&self) -> String {
        let mut text = String::new();
        self.flag_table(&mut text, "CVODE_FLAGS", "CV_", "`CVode*` (`cvode/cvode.h`)");
        self.flag_table(
            &mut text,
            "CVODE_LINEAR_FLAGS",
            "CVLS_",
            "CVODE's linear solver interface (`cvode/cvode_ls.h`)",
        );
        self.flag_table(
            &mut text,
            "ARKODE_FLAGS",
            "ARK_",
            "`ARKode*`, `ERKStep*` and `ARKStep*` (`arkode/arkode.h`)",
        );
        self.flag_table(
            &mut text,
            "ARKODE_LINEAR_FLAGS",
            "ARKLS_",
            "ARKODE's linear solver interface (`arkode/arkode_ls.h`)",
        );
        text
    }

    fn flag_table(&self, text: &mut String, name: &str, prefix: &str, origin: &str) {
        // The prefix also names modes: a flag is negative, or one of NOT_NEGATIVE.
        const NOT_NEGATIVE: [&str; 4] = ["SUCCESS", "TSTOP_RETURN", "ROOT_RETURN", "WARNING"];
        const MODES: [&str; 2] = ["ADAPT_", "INTERP_NONE"];
        let mut flags: BTreeMap<i64, &str> = BTreeMap::new();
        for (macro_name, &value) in &self.integers {
            let Some(rest) = macro_name.strip_prefix(prefix) else {
                continue;
            };
            let is_mode = MODES.iter().any(|mode| rest.starts_with(mode));
            if (value < 0 && !is_mode) || NOT_NEGATIVE.contains(&rest) {
                // If two names share a number (ARK_POSTPROCESS_FAIL and _STEP_FAIL), the last one is kept.
                flags.insert(value, macro_name);
            }
        }
        assert!(
            flags.contains_key(&0),
            "no {prefix}SUCCESS among the macros of the SUNDIALS headers"
        );

        let mut line = |s: String| writeln!(text, "{s}").expect("a String takes all");
        line(format!("/// Return flags of {origin}."));
        line(format!("const {name}: &[(i32, &str)] = &["));
        for (value, macro_name) in flags.iter().rev() {
            line(format!("    ({value}, \"{macro_name}\"),"));
        }
        line("];\n".to_owned());
    }
}

fn name_compiler() {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("--version").output().ok();
    let version = output
        .filter(|output| output.status.success())
        .map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    println!(
        "cargo:rustc-env=STICKSLIP_RUSTC={}",
        version.as_deref().unwrap_or("unknown")
    );
}
