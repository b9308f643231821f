//! File of a work-precision study.

use super::{Knob, Measurement, MethodErrors, PrecisionReference, PrecisionStudy, StudyResult};
use crate::provenance;
use std::path::{Path, PathBuf};
use stickslip_engine::simulation::Method;
use stickslip_files::schema::{
    INPUT_RESOLVED, SHORT_CHUNK, TableSchema, Variable, WORK_PRECISION_FORMAT, group, kind_flags,
};
use stickslip_files::{
    DeclaredColumn, Reason, Reservation, ResultError, Status, StudyFile, StudyHeader, columns, quantity,
};

/// Columns of /runs after the method.
const RUN_COLUMNS: &[DeclaredColumn<Measurement>] = &columns! { run, x:
    Variable::quantity("rtol", "1", "solver.rtol, NaN with a fixed step"),
        known(run.knob.rtol_and_step().0), run.knob = Knob::Tolerance(x);
    Variable::quantity("fixed_step", "s", "solver.fixed_step, NaN with a tolerance"),
        known(run.knob.rtol_and_step().1), if x.is_finite() { run.knob = Knob::FixedStep(x) };
    Variable::code("outcome", "whether the run came to its end", &[(0, "complete"), (1, "failed")]),
        run.failure.is_some().into(), run.failure = (x != 0.0).then(String::new);
    Variable::code("same_sequence", "whether the events are those of the reference, in its order", &[(0, "no"), (1, "yes")]),
        run.same_sequence.into(), run.same_sequence = x != 0.0;
    Variable::count("events", "events of the sequence"), run.events as f64, run.events = x as usize;
    Variable::quantity("onset_error", "s", "error of the first stick, NaN where there is none to compare"),
        known(run.errors.onset), run.errors.onset = finite(x);
    Variable::quantity("final_stick_error", "s", "error of the stick in which the run ends, NaN where there is none to compare"),
        known(run.errors.final_stick), run.errors.final_stick = finite(x);
    Variable::quantity("largest_event_error", "s", "largest error of all events, NaN where their sequence is another"),
        known(run.errors.largest), run.errors.largest = finite(x);
    Variable::count("steps", "steps of the integrators"), run.steps as f64, run.steps = x as u64;
    Variable::count("rhs_evaluations", "evaluations of the right-hand side"),
        run.rhs_evaluations as f64, run.rhs_evaluations = x as u64;
    Variable::count("jacobian_evaluations", "evaluations of the Jacobian"),
        run.jacobian_evaluations as f64, run.jacobian_evaluations = x as u64;
    Variable::quantity("wall_time", "s", "time of the integration, the least of its repetitions"),
        run.wall_time, run.wall_time = x;
};

/// Attributes of /reference: smaller errors count as zero.
const UNCERTAINTIES: &[DeclaredColumn<MethodErrors>] = &columns! { errors, x:
    Variable::quantity("onset_uncertainty", "s", "uncertainty of the first stick"),
        known(errors.onset), errors.onset = finite(x);
    Variable::quantity("final_stick_uncertainty", "s", "uncertainty of the stick in which the run ends"),
        known(errors.final_stick), errors.final_stick = finite(x);
    Variable::quantity("largest_event_uncertainty", "s", "largest uncertainty of all events"),
        known(errors.largest), errors.largest = finite(x);
};

fn known(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

impl StudyResult {
    /// Writes the file of a study that began at `started` to a reserved place, and returns its path. An incomplete study
    /// keeps the partial name.
    pub fn write(&self, study: &PrecisionStudy, started: &str, place: &Reservation) -> Result<PathBuf, ResultError> {
        let resolved = study.runs.first().map(|run| run.2.resolved()).unwrap_or_default();
        let about = "every parameter of the first run in SI units (TOML)";
        let header = StudyHeader {
            inputs: vec![(INPUT_RESOLVED, about, resolved)],
            meta: provenance::program(started),
            ..study.head.of_file(format!("{started} {}", provenance::command_line()))
        };
        let mut methods: Vec<Method> = Vec::new();
        for run in &self.measurements {
            if !methods.contains(&run.method) {
                methods.push(run.method);
            }
        }
        let words = methods.iter().map(|method| method.name().to_owned());
        let mut variables = vec![
            Variable::index("run", "index of the run"),
            Variable::words("method", "integration method", (0..).zip(words).collect()),
        ];
        variables.extend(RUN_COLUMNS.iter().map(|column| (column.variable)()));
        let runs = self.measurements.iter().enumerate().map(|(index, run)| {
            let method = methods.iter().position(|&method| method == run.method);
            let head = [index as f64, method.unwrap_or_default() as f64];
            head.into_iter()
                .chain(RUN_COLUMNS.iter().map(|column| (column.get)(run)))
                .collect()
        });
        let reference = &self.reference;
        let events = reference.events.iter().zip(&reference.uncertainties).enumerate();
        let events = events
            .map(|(index, (&(kind, time), &uncertainty))| vec![index as f64, kind.code().into(), time, uncertainty]);
        let of_events = vec![
            Variable::index("event", "index of the event"),
            Variable::code("kind", "what happened", &kind_flags()),
            Variable::quantity("time", "s", "time"),
            Variable::quantity("time_uncertainty", "s", "uncertainty of the time"),
        ];
        let uncertainties = UNCERTAINTIES.iter().flat_map(|one| {
            let (value, variable) = ((one.get)(&self.uncertainty), (one.variable)());
            quantity(&variable.name, value, &variable.units, &variable.long_name)
        });
        let description = ("description".to_owned(), reference.description.as_str().into());
        let table = |group, variables| TableSchema {
            group,
            chunk: SHORT_CHUNK,
            variables,
        };
        let tables = [
            (table(group::RUNS, variables), runs.collect(), Vec::new()),
            (
                table(group::REFERENCE, of_events),
                events.collect(),
                std::iter::once(description).chain(uncertainties).collect(),
            ),
        ];
        header.write_work_precision(&tables, place, &Status::of(self.interrupted))
    }

    /// Reads title and results of a study for a figure, without the events of the reference.
    ///
    /// # Errors
    /// The file is missing, of another kind, of a newer version, or damaged.
    pub fn read(path: &Path) -> Result<(String, StudyResult), ResultError> {
        let file = StudyFile::open(path, WORK_PRECISION_FORMAT)?;
        let runs = file.table(group::RUNS)?;
        let methods = file.words("runs/method")?;
        let codes = runs.column("method")?.into_iter();
        let found = codes.map(|code| {
            let name = methods.get(code as usize).filter(|_| code >= 0.0);
            let (what, code) = ("/runs/method", code as i8);
            let method = name.and_then(|(_, name)| Method::from_name(name));
            let method = method.ok_or_else(|| Reason::UnknownCode { what, code }.of(path))?;
            Ok(Measurement::new(method, Knob::Tolerance(f64::NAN)))
        });
        let mut measurements = found.collect::<Result<Vec<_>, ResultError>>()?;
        for column in RUN_COLUMNS {
            column.read(&runs, &mut measurements)?;
        }
        let mut uncertainty = MethodErrors::default();
        for one in UNCERTAINTIES {
            let value = file.number_attribute(group::REFERENCE, &(one.variable)().name)?;
            (one.set)(&mut uncertainty, value.unwrap_or(f64::NAN));
        }
        let description = file.text_attribute(group::REFERENCE, "description")?;
        let result = StudyResult {
            reference: PrecisionReference {
                description: description.unwrap_or_default(),
                events: Vec::new(),
                uncertainties: Vec::new(),
            },
            uncertainty,
            measurements,
            interrupted: false,
        };
        Ok((file.text_attribute("", "title")?.unwrap_or_default(), result))
    }
}
