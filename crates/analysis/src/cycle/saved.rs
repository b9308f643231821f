//! Cycle as a case, whose run over one period is an ordinary result, and the cycle's group in the file.

use super::equations::{Guess, motion};
use super::family::Family;
use super::find::{closed, in_slip, to_slip};
use super::orbit::{Multiplier, MultiplierKind, Orbit};
use crate::error::Error;
use nalgebra::DVector;
use stickslip_case::quantity::Dimension;
use stickslip_case::{Case, CaseError, CaseSource, Motion, Override, WrittenCase};
use stickslip_engine::simulation::{Excitation, Following, Method, OutputOptions, SolverOptions, stated_start};
use stickslip_files::schema::{Variable, group};
use stickslip_files::{Addition, DeclaredColumn, Reason, ResultFile, columns};
use stickslip_system::model::equations::{Engagement, Outside, Side, SystemEquations};
use stickslip_system::model::system::{ContactLaw, Initial, Pressing, System};
use stickslip_system::watch::Watch;

const SAMPLES: f64 = 1000.0;

impl Orbit {
    /// Case of one period of the motion. It starts at phase zero of the case's drives; for an autonomous motion, in
    /// the middle of the longest slip. Signals keep their final values, and there are no kicks.
    pub fn case(&self, family: &Family) -> Result<Case, Error> {
        let member = family.at(&self.values, false)?;
        let mut state = DVector::from_column_slice(&self.state);
        if let Some(period) = member.period
            && self.time > 0.0
        {
            let rest = period - self.time;
            state = motion(&member, (self.time, &state), rest, false, &|| false)?.end;
        }
        let given = family.case_at(&self.values)?;
        let mut case = match given.system.pressing {
            Pressing::Axial { .. } => given.in_general_form(),
            Pressing::Force(_) => given,
        };
        let outside = Excitation::new(&member.system).at(0, 0.0);
        let (initial, deflection) = stated(&SystemEquations::new(&member.system), &outside, state.as_slice());
        case.system = System {
            initial,
            ..member.system
        };
        if let (Some(deflection), ContactLaw::Bristles(bristles)) = (deflection, &mut case.system.contact) {
            bristles.deflection = deflection;
        }
        case.title = format!("{}: one period", case.title);
        case.output = OutputOptions {
            end_time: self.period,
            interval: self.period / SAMPLES,
            windows: Vec::new(),
            steps: false,
            follow: Following {
                dense: true,
                ..Following::default()
            },
        };
        case.solver = SolverOptions {
            method: Method::Series,
            max_events: case.solver.max_events,
            ..SolverOptions::default()
        };
        Ok(case)
    }

    /// Drive periods from the start of [`Self::case`] to the origin of [`Self::time`], modulo the period.
    pub fn periods_before(&self) -> u32 {
        match self.multiple {
            Some(multiple) if self.time > 0.0 => multiple - 1,
            _ => 0,
        }
    }

    /// The motion with its times as in the file of [`Self::case`], which starts at phase zero of the drives.
    pub fn in_file(&self, case: &Case) -> Orbit {
        let shift = self
            .multiple
            .map_or(0.0, |multiple| self.time - self.period / f64::from(multiple));
        let in_file = |time: f64| (time + shift).rem_euclid(case.output.end_time);
        let mut orbit = self.clone();
        for event in &mut orbit.events {
            event.time = in_file(event.time);
        }
        orbit.events.sort_by(|a, b| a.time.total_cmp(&b.time));
        if let Some(nearest) = &mut orbit.nearest {
            nearest.time = in_file(nearest.time);
        }
        orbit
    }

    /// Group /cycle in the file of a period.
    pub fn additions(&self, family: &Family, source: &str, overrides: &[String]) -> Vec<Addition> {
        let motion = family.case().motion();
        let mut cycle = Addition::new(group::CYCLE);
        let declared = ORBIT.iter();
        cycle.quantities(declared.map(|one| (in_units((one.variable)(), motion), (one.get)(self))));
        cycle.attribute("border", self.nearest.map_or("none", |nearest| nearest.border.name()));
        cycle.attribute("stability", self.stability.name());
        cycle.attribute("sequence", self.sequence().as_str());
        let about = "number of the multiplier, the largest first";
        cycle.dimension("multiplier", self.multipliers.len(), about);
        cycle.table("multiplier", MULTIPLIERS, &self.multipliers);
        let about = "the case whose motion this is, as it was given (TOML)";
        cycle.text("source", about, source.to_owned());
        let about = "overrides of the case, KEY=VALUE in each line";
        cycle.text("overrides", about, overrides.join("\n"));
        vec![cycle]
    }
}

/// A mechanical state as stated in a case, and the deflection of bristles.
pub(super) fn stated(equations: &SystemEquations, outside: &Outside, state: &[f64]) -> (Initial, Option<f64>) {
    let mut y = vec![0.0; equations.dimension];
    y[..state.len()].copy_from_slice(state);
    let twists = |side: &Side| (0..side.shafts()).map(|i| side.twist(i, &y)).collect();
    let initial = Initial {
        rotor_twist: twists(&equations.rotor),
        rotor_speed: equations.rotor.speeds(&outside.rotor, &y),
        stator_twist: twists(&equations.stator),
        stator_speed: equations.stator.speeds(&outside.stator, &y),
    };
    let deflection = match equations.engagement {
        Engagement::Bristles(.., at) => Some(y[at]),
        _ => None,
    };
    (initial, deflection)
}

/// A variable of a rotation in the units of another motion.
pub(crate) fn in_units(mut variable: Variable, motion: Motion) -> Variable {
    let of_rotation = [Dimension::Angle, Dimension::AngularVelocity];
    if let Some(dimension) = of_rotation.into_iter().find(|one| one.unit() == variable.units) {
        variable.units = motion.dimension(dimension).unit().to_owned();
    }
    variable
}

/// Attributes of /cycle with the units of a rotation.
const ORBIT: &[DeclaredColumn<Orbit>] = &columns! { orbit:
    Variable::quantity("period", "s", "period of the motion"), orbit.period;
    Variable::quantity("error", "1", "last step of Newton's method, over the size of each component"),
        orbit.error;
    Variable::quantity("multiple", "1", "periods of the drives in it; NaN of an autonomous motion"),
        orbit.multiple.map_or(f64::NAN, f64::from);
    Variable::quantity("amplitude", "rad", "half of what the position sweeps"), orbit.amplitude;
    Variable::quantity("least_position", "rad", "least position"), orbit.position.0;
    Variable::quantity("largest_position", "rad", "largest position"), orbit.position.1;
    Variable::quantity("least_relative_velocity", "rad/s", "least omega_r"), orbit.relative_velocity.0;
    Variable::quantity("largest_relative_velocity", "rad/s", "largest omega_r"), orbit.relative_velocity.1;
    Variable::quantity("sticks", "1", "sticks in a period"), orbit.sticks as f64;
    Variable::quantity("shortest_stick", "s", "duration of the shortest stick; NaN: none"),
        orbit.shortest_stick.unwrap_or(f64::NAN);
    Variable::quantity("margin", "1", "relative distance of the nearest other sequence of events; NaN: none is near"),
        orbit.nearest.map_or(f64::NAN, |nearest| nearest.distance);
};

const MULTIPLIERS: &[DeclaredColumn<Multiplier>] = &columns! { one:
    Variable::quantity("multiplier_real", "1", "real part of the multiplier"), one.real;
    Variable::quantity("multiplier_imaginary", "1", "imaginary part of the multiplier"), one.imaginary;
    Variable::words(
        "multiplier_kind", "why the multiplier has its value: of a disturbance, 1 along an autonomous motion, 0 by a stick",
        MultiplierKind::codes()),
        f64::from(one.kind as i8);
};

/// Finds the cycle of a file again, and returns family, orbit, and original case.
pub fn from_file(file: &ResultFile, stop: &dyn Watch) -> Result<(Family, Orbit, CycleOrigin), Error> {
    let text = |name: &str| {
        let found = file.text_variable(group::CYCLE, name)?;
        Ok::<_, Error>(found.ok_or_else(|| Reason::Missing(format!("/cycle/{name}")).of(file.path()))?)
    };
    let source = CaseSource {
        text: text("source")?,
        origin: stickslip_case::Origin::Result(file.path().to_owned()),
    };
    let changes: Result<Vec<Override>, CaseError> = text("overrides")?
        .lines()
        .filter(|line| !line.is_empty())
        .map(Override::parse)
        .collect();
    let changes = changes?;
    let written = WrittenCase::read(&source, &changes)?;
    let family = Family::new(written, &[])?;
    let stored = Case::read(&CaseSource::result(file.path(), file.resolved()?), &[])?;
    let added = file.added_group(group::CYCLE, 0)?;
    let multiple = added.and_then(|added| {
        let found = added.attributes.into_iter().find(|attribute| attribute.0 == "multiple");
        found.and_then(|attribute| attribute.1.number())
    });
    let guess = Guess {
        time: 0.0,
        state: stated_start(&stored.system),
        period: stored.output.end_time,
        values: Vec::new(),
    };
    let multiple = multiple.filter(|multiple| *multiple >= 1.0).unwrap_or(1.0);
    let member = family.at(&[], false)?;
    // An autonomous motion already starts in a slip.
    let (guess, periods_before) = match member.period {
        None => (guess, 0),
        Some(period) => {
            let shift = to_slip(&member, &guess, stop)?;
            (in_slip(&member, &guess, stop)?, (shift / period).floor() as u32)
        }
    };
    let orbit = closed(&family, multiple as u32, &guess, stop)?;
    let origin = CycleOrigin {
        source,
        changes,
        periods_before,
    };
    Ok((family, orbit, origin))
}

/// Original case of a cycle.
#[derive(Debug, Clone)]
pub struct CycleOrigin {
    /// Source text.
    pub source: CaseSource,
    /// Overrides.
    pub changes: Vec<Override>,
    /// Drive periods from the start of the file to the orbit's time origin.
    pub periods_before: u32,
}
