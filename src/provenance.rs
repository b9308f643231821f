//! What the files of this program say of where they come from: which program, on which machine, called how and when.

use crate::case::{Case, Motion};
use crate::quote::in_shell;
use crate::results::schema::{Extension, META_MOTION};
use crate::results::{AttributeValue, Header};
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

/// Attributes with their names.
type Attributes = Vec<(String, AttributeValue)>;

fn named<const N: usize, T: Into<AttributeValue>>(attributes: [(&str, T); N]) -> Attributes {
    attributes.map(|(name, value)| (name.to_owned(), value.into())).into()
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
fn events(method: Method) -> Attributes {
    let comment = if method.locates_events() {
        "times are zeros of the guards, located to the accuracy of the method"
    } else {
        "nothing was located: an event has the time of the end of the step at which it was seen, and happened, if it is no \
         artefact of the steps, within last_step of the segment that it ends"
    };
    named([("event_location", event_location(method)), ("comment", comment)])
}

/// Attributes of /meta that say which program on which machine: all that a sweep file has, because they are the same in
/// every sweep of a study.
pub(crate) fn build() -> Attributes {
    named([
        ("program_version", env!("CARGO_PKG_VERSION")),
        ("program_commit", env!("STICKSLIP_COMMIT")),
        ("sundials_version", crate::sundials::SUNDIALS_VERSION),
        ("hdf5_version", &hdf5_version()),
        ("rustc_version", env!("STICKSLIP_RUSTC")),
        (
            "platform",
            &format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        ),
    ])
}

/// The same, with what was called for and when.
pub(crate) fn program(started: &str) -> Attributes {
    let mut meta = build();
    meta.extend(named([("command_line", command_line().as_str()), ("started", started)]));
    meta
}

/// Attributes of /meta of a run.
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
    // What the solvers themselves are given in each phase.
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

impl Header {
    /// Of a run of `case`, which starts now. The resolved case stands for the text as it was given.
    pub fn new(case: &Case) -> Self {
        let (started, resolved) = (now(), case.resolved());
        Header {
            title: case.title.clone(),
            source: source(),
            references: case.words.references().to_owned(),
            history: format!("{started} {}", command_line()),
            case_text: resolved.clone(),
            resolved,
            meta: meta(case, &started),
            events: events(case.solver.method),
            extension: extension(case),
        }
    }

    /// Of a run of the same case again, with other settings: title and text stay as they were given.
    pub(crate) fn of_repetition(&self, case: &Case) -> Self {
        Header {
            title: self.title.clone(),
            case_text: self.case_text.clone(),
            ..Header::new(case)
        }
    }
}

/// What the files of a case have beyond the tables that all have.
pub(crate) fn extension(case: &Case) -> Extension {
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
