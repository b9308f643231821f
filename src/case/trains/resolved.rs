//! A case in the general form as TOML in SI, at full precision.

use std::fmt::Write;

use toml_edit::Value;

use super::keys::{self, LUGRE};
use crate::case::draft::Draft;
use crate::case::quantity::Dimension;
use crate::case::resolved::{self, Only};
use crate::case::schema::{self, Kind};
use crate::case::{Case, Motion};
use crate::model::system::{ContactLaw, End, KickSide, Pressing, Smoothing, Train};
use crate::signal::{Drive, Frequency, SIGNALS, Shape, Signal, Table};

/// Every value of the case.
pub(in crate::case) fn write(case: &Case) -> String {
    let trains = &case.system;
    let shared = Draft::of(case);
    let motion = case.motion();
    let only = |wanted: fn(&str) -> bool| resolved::keys(&shared, Only { wanted, motion });
    let mut text = Text {
        text: only(|path| path == "title"),
        motion,
    };
    if motion != Motion::default() {
        text.line("motion", &quoted(motion.name()));
    }
    text.train("rotor", &trains.rotor);
    text.train("stator", &trains.stator);
    text.heading("contact");
    if motion == Motion::Rotation {
        text.plain(
            "radius",
            &format!("{:?}", trains.radius),
            "r, effective friction radius [m]",
        );
    }
    if trains.contact == ContactLaw::StickSlip {
        let test = only(|path| path == "contact.breakaway_test");
        text.text.push_str(test.trim_start_matches("\n[contact]\n"));
    }
    match &trains.pressing {
        Pressing::Force(force) => text.line("contact.normal_force", &signal(force)),
        Pressing::Axial { .. } => {
            let axial = only(|path| path.starts_with("axial.") || path.starts_with("actuation."));
            text.text.push_str(&axial);
        }
    }
    text.friction(case, &shared);
    text.initial(case);
    for kick in &trains.kicks {
        text.text.push_str("\n[[perturbation]]\n");
        text.plain("time", &resolved::moment(kick.time), "when the kick comes [s]");
        let unit = motion.dimension(Dimension::AngularVelocity).unit();
        text.plain(
            "relative_velocity",
            &format!("{:?}", kick.relative_velocity),
            &format!("delta, jump of omega_r [{unit}]"),
        );
        let side = match kick.on {
            KickSide::Both => "both",
            KickSide::Rotor => "rotor",
            KickSide::Stator => "stator",
        };
        text.line("perturbation[].on", &quoted(side));
    }
    let rest = only(|path| path.starts_with("solver.") || path.starts_with("output."));
    text.text.push_str(&rest);
    text.text
}

struct Text {
    text: String,
    motion: Motion,
}

impl Text {
    fn heading(&mut self, table: &str) {
        let _ = write!(self.text, "\n[{table}]\n");
    }

    fn plain(&mut self, name: &str, value: &str, about: &str) {
        let _ = writeln!(self.text, "{name} = {value} # {about}");
    }

    /// A key of trains.
    fn line(&mut self, path: &str, value: &str) {
        let key = keys::find(path);
        let name = path.rsplit('.').next().unwrap_or(path);
        let unit = match (&key.kind, key.dimension()) {
            (Kind::Index, _) | (_, None) => String::new(),
            (_, Some(dimension)) => format!(" [{}]", self.motion.dimension(dimension).unit()),
        };
        self.plain(name, value, &format!("{}{unit}", key.description));
    }

    fn train(&mut self, side: &str, train: &Train) {
        self.heading(side);
        let lists = [
            ("inertia", &train.inertia),
            ("stiffness", &train.stiffness),
            ("damping", &train.damping),
            ("viscous", &train.viscous),
        ];
        for (name, values) in lists {
            self.list(&format!("{side}.{name}"), values);
        }
        let (end, speed) = match &train.end {
            End::Free => ("free", None),
            End::Fixed => ("fixed", None),
            End::Driven(speed) => ("driven", Some(speed)),
        };
        self.line(&format!("{side}.end"), &quoted(end));
        if let Some(speed) = speed {
            self.line(&format!("{side}.speed"), &signal(speed));
        }
        if let Some(torque) = &train.torque {
            self.line(&format!("{side}.torque"), &signal(&torque.signal));
            self.line(&format!("{side}.torque_on"), &torque.on.to_string());
        }
    }

    fn list(&mut self, path: &str, values: &[f64]) {
        if !values.is_empty() {
            self.line(path, &format!("{values:?}"));
        }
    }

    fn friction(&mut self, case: &Case, shared: &Draft) {
        let trains = &case.system;
        let motion = self.motion;
        if let ContactLaw::Bristles(bristles) = &trains.contact {
            self.heading("friction");
            self.plain("law", &quoted(LUGRE), "bristles; below, the law g of their limits");
            let g = |path: &str| {
                path.starts_with("friction.") && path != schema::FRICTION_LAW && path != "friction.viscous"
            };
            let law = resolved::keys(shared, Only { wanted: g, motion });
            self.text.push_str(law.trim_start_matches("\n[friction]\n"));
            self.line("friction.bristle_stiffness", &format!("{:?}", bristles.stiffness));
            self.line("friction.bristle_damping", &format!("{:?}", bristles.damping));
            let unit = motion.dimension(Dimension::FrictionDecay).unit();
            let about = format!("sigma_2, rise of the friction coefficient with sliding speed [{unit}]");
            self.plain("viscous", &format!("{:?}", bristles.viscous), &about);
        } else {
            let law = |path: &str| path.starts_with("friction.");
            self.text
                .push_str(&resolved::keys(shared, Only { wanted: law, motion }));
        }
        if trains.contact != ContactLaw::StickSlip {
            self.line("friction.threshold", &format!("{:?}", case.threshold));
        }
        if let ContactLaw::Regularised(regularisation) = &trains.contact {
            self.heading("friction.regularisation");
            let function = match regularisation.function {
                Smoothing::Tanh => "tanh",
                Smoothing::Arctan => "arctan",
            };
            self.line("friction.regularisation.function", &quoted(function));
            self.line("friction.regularisation.speed", &format!("{:?}", regularisation.speed));
        }
    }

    fn initial(&mut self, case: &Case) {
        let initial = &case.system.initial;
        self.heading("initial");
        self.list("initial.rotor_twist", &initial.rotor_twist);
        self.list("initial.rotor_speed", &initial.rotor_speed);
        self.list("initial.stator_twist", &initial.stator_twist);
        self.list("initial.stator_speed", &initial.stator_speed);
    }
}

fn quoted(word: &str) -> String {
    Value::from(word).to_string()
}

/// A signal as a value of TOML.
fn signal(drive: &Drive) -> String {
    match drive {
        Drive::Value(value) => format!("{value:?}"),
        Drive::Linear(Signal::Ramp(ramp)) => format!(
            "{{ profile = \"ramp\", value = {:?}, rise_time = {:?} }}",
            ramp.value, ramp.rise_time
        ),
        Drive::Linear(Signal::Table(Table { time, value })) => {
            format!("{{ profile = \"table\", time = {time:?}, value = {value:?} }}")
        }
        Drive::Wave(wave) => {
            let shape = match wave.shape {
                Shape::Sine => "sine",
                Shape::Cosine => "cosine",
            };
            let frequency = match wave.frequency {
                Frequency::Cycles(frequency) => format!("frequency = {frequency:?}"),
                Frequency::Angular(frequency) => format!("angular_frequency = {frequency:?}"),
            };
            let time =
                |name: &str, time: Option<f64>| time.map_or(String::new(), |time| format!(", {name} = {time:?}"));
            format!(
                "{{ profile = \"{shape}\", mean = {:?}, amplitude = {:?}, {frequency}, phase = {:?}{}{} }}",
                wave.mean,
                wave.amplitude,
                wave.phase,
                time("from", wave.from),
                time("to", wave.to)
            )
        }
        Drive::Sum(terms) => {
            let terms: Vec<String> = terms.iter().map(signal).collect();
            format!("{{ profile = \"sum\", {SIGNALS} = [{}] }}", terms.join(", "))
        }
    }
}
