//! Provenance of files: program, machine, command and time.

use std::sync::OnceLock;
use stickslip_case::{Case, Motion};
use stickslip_engine::simulation::{self, Method, procedure};
use stickslip_files::schema::{Extension, META_MOTION, META_POINT_COMMAND};
use stickslip_files::{AttributeValue, Header};
use stickslip_system::quote::in_shell;

static COMMIT: OnceLock<&str> = OnceLock::new();

/// Sets the program's commit for files. Only the first call counts; the default is `unknown`.
pub fn set_commit(commit: &'static str) {
    COMMIT.get_or_init(|| commit);
}

fn commit() -> &'static str {
    COMMIT.get().copied().unwrap_or("unknown")
}

fn hdf5_version() -> String {
    let (major, minor, release) = hdf5::library_version();
    format!("{major}.{minor}.{release}")
}

/// Versions of the program and its libraries, for `--version`.
pub fn versions() -> String {
    format!(
        "{} ({})\nSUNDIALS {}\nHDF5 {}",
        env!("CARGO_PKG_VERSION"),
        commit(),
        stickslip_engine::sundials::SUNDIALS_VERSION,
        hdf5_version()
    )
}

/// Value of the root attribute `source`.
pub fn source() -> String {
    format!(
        "stickslip {} with SUNDIALS {}",
        env!("CARGO_PKG_VERSION"),
        stickslip_engine::sundials::SUNDIALS_VERSION
    )
}

/// Command line, quoted for a shell.
pub fn command_line() -> String {
    let mut arguments = std::env::args_os().map(|a| a.to_string_lossy().into_owned());
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

/// Current time in UTC as ISO 8601, to the second.
pub fn now() -> String {
    humantime::format_rfc3339_seconds(std::time::SystemTime::now()).to_string()
}

type Attributes = Vec<(String, AttributeValue)>;

fn named<const N: usize, T: Into<AttributeValue>>(attributes: [(&str, T); N]) -> Attributes {
    attributes.map(|(name, value)| (name.to_owned(), value.into())).into()
}

/// `end-of-step` if the method does not look inside a step.
fn event_location(method: Method) -> &'static str {
    if method.locates_events() {
        "located"
    } else {
        "end-of-step"
    }
}

fn events(method: Method) -> Attributes {
    let comment = if method.locates_events() {
        "times are zeros of the guards, located to the accuracy of the method"
    } else {
        "nothing was located: an event has the time of the end of the step at which it was seen, and happened, if it is no \
         artefact of the steps, within last_step of the segment that it ends"
    };
    named([("event_location", event_location(method)), ("comment", comment)])
}

/// Attributes of /meta on program and machine. A sweep file has no others, so it is the same in every sweep.
pub(crate) fn build() -> Attributes {
    named([
        ("program_version", env!("CARGO_PKG_VERSION")),
        ("program_commit", commit()),
        ("sundials_version", stickslip_engine::sundials::SUNDIALS_VERSION),
        ("hdf5_version", &hdf5_version()),
        ("rustc_version", stickslip_engine::sundials::RUSTC_VERSION),
        (
            "platform",
            &format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        ),
    ])
}

/// Length of the longest stored command: all attributes of a group share 64 KiB.
const LONGEST_COMMAND: usize = 32_768;

/// Attribute of /meta with the command for a single point of a study; `None` if it is too long.
pub(crate) fn point_command(command: String) -> Option<(String, AttributeValue)> {
    (command.len() < LONGEST_COMMAND).then(|| (META_POINT_COMMAND.to_owned(), command.into()))
}

/// Attributes of /meta on program and machine, with command line and start time.
pub fn program(started: &str) -> Attributes {
    let mut meta = build();
    meta.extend(named([("command_line", command_line().as_str()), ("started", started)]));
    meta
}

fn meta(case: &Case, started: &str) -> Attributes {
    let solver = &case.solver;
    let mut meta = program(started);
    meta.extend(named([
        ("method", solver.method.name()),
        ("event_location", event_location(solver.method)),
    ]));
    let motion = case
        .words
        .motion_attribute()
        .map(|motion| named([(META_MOTION, motion)]));
    meta.extend(motion.into_iter().flatten());
    meta.extend(named([("rtol", solver.rtol), ("max_events", solver.max_events as f64)]));
    meta.extend(solver.fixed_step.map(|step| ("fixed_step".to_owned(), step.into())));
    if solver.method == Method::Paper {
        let settings = procedure::Settings::new(solver);
        meta.extend(named([
            ("step_tolerance", settings.tolerance),
            ("shortest_step", settings.shortest_step),
            ("longest_step", settings.longest_step),
            ("stick_epsilon", procedure::EPSILON),
        ]));
        return meta;
    }
    if solver.method == Method::Rk4 {
        return meta;
    }
    let [sliding, resolved] = simulation::solver_settings(&case.system, solver);
    for (phase, settings) in [("sliding", sliding), ("resolved", resolved)] {
        let numbers = [
            ("rtol", Some(settings.relative)),
            ("atol_twist", Some(settings.twist)),
            ("atol_rate", Some(settings.rate)),
            ("atol_speed", Some(settings.speed)),
            ("max_step", settings.max_step),
        ];
        let known = |(name, value): (&str, Option<f64>)| Some((format!("{phase}_{name}"), value?.into()));
        meta.extend(numbers.into_iter().filter_map(known));
    }
    meta
}

/// Header of a run of `case` that starts now. By default the case text is the resolved case.
pub fn header(case: &Case) -> Header {
    let (started, resolved) = (now(), case.resolved());
    Header {
        title: case.title.clone(),
        source: source(),
        references: case.words.references().to_owned(),
        history: format!("{started} {}", command_line()),
        case_text: resolved.clone(),
        resolved,
        asked: None,
        changed: Vec::new(),
        meta: meta(case, &started),
        events: events(case.solver.method),
        extension: extension(case),
    }
}

/// Header of a repetition with other settings. Title and text stay those of `first`.
pub fn header_of_repetition(first: &Header, case: &Case) -> Header {
    Header {
        title: first.title.clone(),
        case_text: first.case_text.clone(),
        asked: Some(first.resolved.clone()),
        changed: first.changed.clone(),
        ..header(case)
    }
}

/// Columns and tables of a case beyond the common ones.
pub fn extension(case: &Case) -> Extension {
    let dense = case.output.follow.dense;
    if !case.words.numbers_parts() {
        return Extension {
            dense,
            ..Extension::default()
        };
    }
    let further = simulation::further(&case.system).into_iter();
    Extension {
        further: further.map(|one| (one.name, one.is_rate, one.long_name)).collect(),
        numbers_parts: true,
        translation: case.motion() == Motion::Translation,
        dense,
    }
}
