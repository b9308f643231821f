//! Which program on which machine.

use crate::case::Case;
use crate::model::torsion::index::{ROTOR_SPEED, ROTOR_TWIST, ROTOR_TWIST_RATE};
use crate::results::MetaValue;
use crate::simulation::chosen_solvers;

/// Version of the HDF5 library in use.
fn hdf5_version() -> String {
    let (major, minor, release) = hdf5::library_version();
    format!("{major}.{minor}.{release}")
}

/// For `--version`: the program's version, and those of the libraries below it.
pub(super) fn versions() -> String {
    format!(
        "{} ({})\nSUNDIALS {}\nHDF5 {}",
        env!("CARGO_PKG_VERSION"),
        env!("STICKSLIP_COMMIT"),
        crate::sundials::SUNDIALS_VERSION,
        hdf5_version()
    )
}

/// Root attribute `source`.
pub(super) fn source() -> String {
    format!(
        "stickslip {} with SUNDIALS {}",
        env!("CARGO_PKG_VERSION"),
        crate::sundials::SUNDIALS_VERSION
    )
}

/// The command line as it was given, quoted where a shell would need it.
pub(super) fn command_line() -> String {
    let quoted = |argument: String| {
        if !argument.is_empty() && argument.chars().all(|c| c.is_alphanumeric() || "-_./=:,+@".contains(c)) {
            argument
        } else {
            format!("'{}'", argument.replace('\'', r"'\''"))
        }
    };
    let mut arguments = std::env::args_os().map(|a| a.to_string_lossy().into_owned());
    // The program's own name without the folder it happens to stand in.
    let program = arguments.next().unwrap_or_default();
    let program = program
        .rsplit(std::path::MAIN_SEPARATOR)
        .next()
        .unwrap_or("stickslip")
        .to_owned();
    std::iter::once(program)
        .chain(arguments.map(quoted))
        .collect::<Vec<_>>()
        .join(" ")
}

/// The instant as ISO 8601 in UTC, to the second.
pub(super) fn now() -> String {
    jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string()
}

/// Attributes of /meta.
pub(super) fn meta(case: &Case, started: &str) -> Vec<(String, MetaValue)> {
    let solver = &case.solver;
    let texts = [
        ("program_version", env!("CARGO_PKG_VERSION").to_owned()),
        ("program_commit", env!("STICKSLIP_COMMIT").to_owned()),
        ("sundials_version", crate::sundials::SUNDIALS_VERSION.to_owned()),
        ("hdf5_version", hdf5_version()),
        ("rustc_version", env!("STICKSLIP_RUSTC").to_owned()),
        (
            "platform",
            format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        ),
        ("command_line", command_line()),
        ("method", solver.method.name().to_owned()),
        ("started", started.to_owned()),
    ];
    let mut meta: Vec<(String, MetaValue)> = texts
        .into_iter()
        .map(|(name, text)| (name.to_owned(), MetaValue::Text(text)))
        .collect();
    let mut number = |name: String, value: f64| meta.push((name, MetaValue::Number(value)));
    number("rtol".to_owned(), solver.rtol);
    number("max_events".to_owned(), solver.max_events as f64);
    // What the solvers themselves were given.
    let (sliding, resolved) = chosen_solvers(&case.parameters, solver);
    for (phase, chosen) in [("sliding", sliding), ("resolved", resolved)] {
        let absolute = |component: usize| chosen.tolerances.absolute[component];
        number(format!("{phase}_rtol"), chosen.tolerances.relative);
        number(format!("{phase}_atol_twist"), absolute(ROTOR_TWIST));
        number(format!("{phase}_atol_rate"), absolute(ROTOR_TWIST_RATE));
        number(format!("{phase}_atol_speed"), absolute(ROTOR_SPEED));
        if let Some(step) = chosen.max_step {
            number(format!("{phase}_max_step"), step);
        }
    }
    meta
}
