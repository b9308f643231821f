//! What the files of this program say of where they come from: which program, on which machine, called how and when.

use crate::case::{Case, Motion};
use crate::quote::in_shell;
use crate::results::schema::{Extension, META_MOTION};
use crate::results::{Header, MetaValue};
use crate::simulation::{self, Method, procedure};

/// Version of the HDF5 library in use.
fn hdf5_version() -> String {
    let (major, minor, release) = hdf5::library_version();
    format!("{major}.{minor}.{release}")
}

/// For `--version`: the program's version, and those of the libraries below it.
#[cfg(feature = "cli")]
pub(crate) fn versions() -> String {
    format!(
        "{} ({})\nSUNDIALS {}\nHDF5 {}",
        env!("CARGO_PKG_VERSION"),
        env!("STICKSLIP_COMMIT"),
        crate::sundials::SUNDIALS_VERSION,
        hdf5_version()
    )
}

/// Root attribute `source`.
pub(crate) fn source() -> String {
    format!(
        "stickslip {} with SUNDIALS {}",
        env!("CARGO_PKG_VERSION"),
        crate::sundials::SUNDIALS_VERSION
    )
}

/// The command line as it was given, quoted where a shell would need it.
pub(crate) fn command_line() -> String {
    let mut arguments = std::env::args_os().map(|a| a.to_string_lossy().into_owned());
    // The program's own name without the folder it happens to stand in.
    let program = arguments.next().unwrap_or_default();
    let program = program
        .rsplit(std::path::MAIN_SEPARATOR)
        .next()
        .unwrap_or("stickslip")
        .to_owned();
    std::iter::once(program)
        .chain(arguments.map(|argument| in_shell(&argument)))
        .collect::<Vec<_>>()
        .join(" ")
}

/// The instant as ISO 8601 in UTC, to the second.
pub(crate) fn now() -> String {
    jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string()
}

/// How the times of the events were found: `located`, or `end-of-step` where nothing looks inside a step.
fn event_location(method: Method) -> &'static str {
    if method.locates_events() {
        "located"
    } else {
        "end-of-step"
    }
}

/// Attributes of /events.
fn events(method: Method) -> Vec<(String, MetaValue)> {
    let comment = if method.locates_events() {
        "times are zeros of the guards, located to the accuracy of the method"
    } else {
        "nothing was located: an event has the time of the end of the step at which it was seen, and happened, if it is no \
         artefact of the steps, within last_step of the segment that it ends"
    };
    [("event_location", event_location(method)), ("comment", comment)]
        .map(|(name, text)| (name.to_owned(), MetaValue::Text(text.to_owned())))
        .to_vec()
}

/// Attributes of /meta that say which program on which machine: all that a sweep file has, because they are the same in
/// every sweep of a study.
pub(crate) fn build() -> Vec<(String, MetaValue)> {
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
    ];
    texts
        .into_iter()
        .map(|(name, text)| (name.to_owned(), MetaValue::Text(text)))
        .collect()
}

/// The same, with what was called for and when.
pub(crate) fn program(started: &str) -> Vec<(String, MetaValue)> {
    let mut meta = build();
    for (name, text) in [("command_line", command_line()), ("started", started.to_owned())] {
        meta.push((name.to_owned(), MetaValue::Text(text)));
    }
    meta
}

/// Attributes of /meta of a run.
fn meta(case: &Case, started: &str) -> Vec<(String, MetaValue)> {
    let solver = &case.solver;
    let mut meta = program(started);
    let motion = case.words().motion_attribute().map(|motion| (META_MOTION, motion));
    let texts = [
        ("method", solver.method.name()),
        ("event_location", event_location(solver.method)),
    ];
    for (name, text) in texts.into_iter().chain(motion) {
        meta.push((name.to_owned(), MetaValue::Text(text.to_owned())));
    }
    for (name, value) in [("rtol", solver.rtol), ("max_events", solver.max_events as f64)] {
        meta.push((name.to_owned(), MetaValue::Number(value)));
    }
    if case.words().lists_tolerances() {
        meta.extend(
            phases(case)
                .into_iter()
                .map(|(name, value)| (name, MetaValue::Number(value))),
        );
    }
    meta
}

/// What the solvers are given in each phase.
fn phases(case: &Case) -> Vec<(String, f64)> {
    let solver = &case.solver;
    let mut found = Vec::new();
    let mut number = |name: String, value: f64| found.push((name, value));
    if let Some(step) = solver.fixed_step {
        number("fixed_step".to_owned(), step);
    }
    if solver.method == Method::Paper {
        let settings = procedure::Settings::new(solver);
        number("step_tolerance".to_owned(), settings.tolerance);
        number("shortest_step".to_owned(), settings.shortest_step);
        number("longest_step".to_owned(), settings.longest_step);
        number("stick_epsilon".to_owned(), procedure::EPSILON);
        return found;
    }
    // What the solvers themselves were given.
    let [sliding, resolved] = simulation::solver_settings(&case.system, solver);
    for (phase, settings) in [("sliding", sliding), ("resolved", resolved)] {
        number(format!("{phase}_rtol"), settings.relative);
        number(format!("{phase}_atol_twist"), settings.twist);
        number(format!("{phase}_atol_rate"), settings.rate);
        number(format!("{phase}_atol_speed"), settings.speed);
        if let Some(step) = settings.max_step {
            number(format!("{phase}_max_step"), step);
        }
    }
    found
}

impl Header {
    /// Of a run of `case`, which starts now; `text` is the case as it was given.
    pub fn new(case: &Case, text: String) -> Self {
        let started = now();
        Header {
            title: case.title.clone(),
            source: source(),
            references: case.words().references().to_owned(),
            history: format!("{started} {}", command_line()),
            case_text: text,
            resolved: case.resolved(),
            meta: meta(case, &started),
            events: events(case.solver.method),
            extension: extension(case),
        }
    }
}

/// What the files of a case have beyond the tables that all have.
pub(crate) fn extension(case: &Case) -> Extension {
    let dense = case.output.follow.dense;
    if !case.words().numbers_parts() {
        return Extension {
            dense,
            ..Extension::default()
        };
    }
    let further = simulation::further(&case.system).into_iter();
    Extension {
        further: further.map(|one| (one.name, one.is_rate, one.long_name)).collect(),
        trains: true,
        translation: case.motion() == Motion::Translation,
        dense,
    }
}
