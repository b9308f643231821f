//! Keys that depend on each other: the two chains of the general form and their state at t = 0, lists with a number for
//! each body; normal force, radius and contact law.

use super::document::{CaseValue, PlacedValue};
use super::place::Content;
use super::quantity::Dimension;
use super::reader::{Given, Reader, content, missing};
use super::schema::{self, Domain, FRICTION_LAW};
use super::value::single;
use super::{Case, Motion, Setting};
use stickslip_system::model::contact::{uniform_pressure_radius, uniform_wear_radius};
use stickslip_system::model::system::{ContactLaw, End, Regularisation, Smoothing, Torque, Train};
use stickslip_system::signal::Drive;

fn train<'a>(case: &'a mut Case, side: &str) -> &'a mut Train {
    match side {
        "rotor" => &mut case.system.rotor,
        _ => &mut case.system.stator,
    }
}

impl Reader {
    pub(super) fn chain(&mut self, case: &mut Case, side: &str) -> bool {
        let path = |name: &str| format!("{side}.{name}");
        match self.root.at(side).map(|node| &node.value) {
            None => {
                let message = format!(
                    "missing: the train of the {side}; write [{side}] with inertia, stiffness and end, or with end = \"fixed\" \
                     alone for rigid ground"
                );
                self.report(side, message);
                return false;
            }
            Some(CaseValue::Table(_)) => {}
            // `check_names` reports it.
            Some(_) => return false,
        }
        let end = match self.has(&path("end")) {
            true => self.fill_path(case, &path("end")),
            false => {
                let message = "missing: what holds the far end; write end = \"free\", \"fixed\" (to the ground) or \"driven\" (at \
                               a speed)";
                self.report(&path("end"), message);
                Given::Absent
            }
        };
        let inertia = self.fill_path(case, &path("inertia"));
        if end != Given::Right || inertia == Given::Wrong {
            return false;
        }
        self.speed(case, side);
        let own = train(case, side);
        let (count, shafts, why) = (own.inertia.len(), own.shafts(), shafts_of(own));
        if count == 0 && own.end == End::Free {
            let message = "missing: a surface without inertia moves as its far end does, and nothing says how a free end moves; \
                           write inertia = [...], or end = \"fixed\" or \"driven\"";
            self.report(&path("inertia"), message);
            return false;
        }
        if shafts > 0 && !self.has(&path("stiffness")) {
            let unit = self.words.motion().dimension(Dimension::TorsionalStiffness).unit();
            let message = format!(
                "missing: {} expected: {why}; write stiffness = [...], numbers in {unit}{}",
                are(shafts),
                match own.end {
                    End::Driven(_) => ", or leave inertia out if the surface is itself driven",
                    End::Fixed => ", or write end = \"free\" if nothing holds it",
                    End::Free => "",
                }
            );
            self.report(&path("stiffness"), message);
        }
        self.counted(case, &path("stiffness"), shafts, &why, f64::NAN);
        self.counted(case, &path("damping"), shafts, &why, 0.0);
        let why = match count {
            0 => "there is no inertia".to_owned(),
            _ => format!("one for each inertia of the {side}"),
        };
        self.counted(case, &path("viscous"), count, &why, 0.0);
        self.torque(case, side, count);
        true
    }

    fn speed(&mut self, case: &mut Case, side: &str) {
        let path = format!("{side}.speed");
        let end = match &train(case, side).end {
            End::Driven(_) if self.has(&path) => {
                self.fill_path(case, &path);
                return;
            }
            End::Driven(_) => {
                let number = self.words.motion().dimension(Dimension::AngularVelocity).number();
                let message = format!("missing: the speed of the driven end; write speed = {number}, or a signal");
                return self.report(&path, message);
            }
            End::Free => "free",
            End::Fixed => "fixed",
        };
        if self.has(&path) {
            let message = format!(
                "belongs to a driven end, but end is \"{end}\": write end = \"driven\", or remove it; speeds at t = 0 are in \
                 [initial]"
            );
            self.report(&path, message);
        }
    }

    fn torque(&mut self, case: &mut Case, side: &str, count: usize) {
        let [torque, on_path] = ["torque", "torque_on"].map(|name| format!("{side}.{name}"));
        if !self.has(&torque) {
            if self.has(&on_path) {
                self.report(
                    &on_path,
                    format!("there is no {torque} that it is about: give one, or remove it"),
                );
            }
            return;
        }
        if count == 0 {
            let message = format!(
                "a torque acts on an inertia, and the {side} has none: its end holds against any torque; remove it, or give inertia"
            );
            return self.report(&torque, message);
        }
        let on = match self.root.at(&on_path).map(|node| &node.value) {
            None => count - 1,
            Some(CaseValue::Integer(on)) if (0..count as i64).contains(on) => *on as usize,
            Some(other) => {
                let written = match other {
                    CaseValue::Integer(on) => on.to_string(),
                    other => other.describe(),
                };
                let message = match count {
                    1 => format!("must be 0, the only inertia of the {side}, but is {written}"),
                    _ => format!(
                        "must be from 0 (the surface) to {} (the outermost of {count} inertias), but is {written}",
                        count - 1
                    ),
                };
                self.report(&on_path, message);
                0
            }
        };
        let signal = Drive::Value(f64::NAN);
        train(case, side).torque = Some(Torque { signal, on });
        self.fill_path(case, &torque);
    }

    pub(super) fn initial(&mut self, case: &mut Case) {
        for side in ["rotor", "stator"] {
            let own = train(case, side);
            let (inertias, shafts) = (own.inertia.len(), own.stiffness.len());
            let turning = match &own.end {
                End::Driven(speed) => speed.at_start(),
                _ => 0.0,
            };
            let why = format!("one for each shaft of the {side}");
            self.counted(case, &format!("initial.{side}_twist"), shafts, &why, 0.0);
            let why = format!("one for each inertia of the {side}");
            self.counted(case, &format!("initial.{side}_speed"), inertias, &why, turning);
        }
        const SPEED: &str = "initial.speed";
        if !self.has(SPEED) {
            return;
        }
        self.fill_path(case, SPEED);
        if case.system.rotor.end != End::Free {
            let message = "is that of every inertia of a rotor with a free end, which this one has not: remove it, or give \
                           rotor_speed";
            self.report(SPEED, message);
        } else if self.has("initial.rotor_speed") {
            let message = "the speeds of the rotor are given twice, with initial.rotor_speed: keep one of them";
            self.report(SPEED, message);
        }
    }

    /// Reads a list that must have `count` elements; `why` explains the count. Missing elements are `default`.
    fn counted(&mut self, case: &mut Case, path: &str, count: usize, why: &str, default: f64) {
        let Some((key, ..)) = schema::find(path, false).next() else {
            return;
        };
        let mut list = vec![default; count];
        if let Some(node) = self.whole_list(path, count, default) {
            match self.taken(content(key, path, &node, self.words.motion())) {
                Some(Content::List(values)) if values.len() == count => list = values,
                Some(Content::List(values)) => {
                    let remedy = if count == 0 { "; remove it" } else { "" };
                    let message = format!("{}, but {} expected: {why}{remedy}", have(values.len()), are(count));
                    self.report(path, message);
                }
                _ => {}
            }
        }
        for mut place in key.places(case, 0) {
            place.set(Content::List(list.clone()));
        }
    }

    /// The list at a path; `None` if it is missing, or if an index beyond it is set, which is reported. In a list
    /// that is set element by element, missing elements are `default`.
    fn whole_list(&mut self, path: &str, count: usize, default: f64) -> Option<PlacedValue> {
        let node = self.root.at(path)?;
        let CaseValue::Table(entries) = &node.value else {
            return Some(node.clone());
        };
        let index = |name: &String| name.parse::<usize>().ok();
        if entries.is_empty() || entries.iter().any(|(name, _)| index(name).is_none()) {
            return Some(node.clone());
        }
        let unset = PlacedValue {
            value: CaseValue::Float(default),
            place: node.place.clone(),
        };
        let mut list = vec![unset.clone(); count];
        for (index, element) in entries
            .iter()
            .filter_map(|(name, element)| Some((index(name)?, element)))
        {
            let Some(place) = list.get_mut(index) else {
                let message = format!("there is no {path}.{index}: {}", schema::elements(path, count));
                self.report(&format!("{path}.{index}"), message);
                return None;
            };
            *place = element.clone();
        }
        Some(PlacedValue {
            value: CaseValue::Array(list),
            ..unset
        })
    }
}

fn have(count: usize) -> String {
    match count {
        0 => "has no number".to_owned(),
        1 => "has one number".to_owned(),
        _ => format!("has {count} numbers"),
    }
}

fn are(count: usize) -> String {
    match count {
        0 => "none is".to_owned(),
        1 => "one is".to_owned(),
        _ => format!("{count} are"),
    }
}

fn shafts_of(train: &Train) -> String {
    let between = match train.inertia.len() {
        0 => return "without inertia there is no shaft".to_owned(),
        1 => None,
        2 => Some("one shaft between the 2 inertias".to_owned()),
        count => Some(format!("{} shafts between the {count} inertias", count - 1)),
    };
    let to_end = match train.end {
        End::Free => None,
        End::Fixed => Some("one from the outermost inertia to the ground"),
        End::Driven(_) => Some("one from the outermost inertia to the driven end"),
    };
    match (between, to_end) {
        (Some(between), Some(to_end)) => format!("{between}, and {to_end}"),
        (Some(between), None) => between,
        (None, Some(to_end)) => to_end.to_owned(),
        (None, None) => "a single inertia with a free end has no shaft".to_owned(),
    }
}

const RADIUS: &str = "contact.radius";
const REGULARISATION: &str = "friction.regularisation";

impl Reader {
    pub(super) fn pressing(&mut self, case: &mut Case) {
        const FORCE: &str = "contact.normal_force";
        const TABLES: [&str; 2] = ["axial", "actuation"];
        match (self.has(FORCE), TABLES.into_iter().find(|table| self.has(table))) {
            (true, Some(table)) => self.report(
                FORCE,
                format!("the normal force is given twice, with [{table}]: keep either normal_force, or [axial] and [actuation]"),
            ),
            (true, None) => {}
            (false, Some(_)) => match TABLES.into_iter().find(|table| !self.has(table)) {
                Some(table) => {
                    let message = format!("missing: the axial mode presses by [axial] and [actuation]; write [{table}]");
                    self.report(table, message);
                }
                None => case.system.pressing = Case::axial_mode(),
            },
            (false, None) => {
                let message = format!(
                    "missing: what presses the surfaces together; write normal_force = {} (or a signal), or give [axial] and \
                     [actuation]",
                    Dimension::Force.number()
                );
                self.report(FORCE, message);
            }
        }
    }

    pub(super) fn radius(&mut self, case: &mut Case) {
        const DIAMETERS: [&str; 3] = ["contact.outer_diameter", "contact.inner_diameter", "contact.wear"];
        let given = DIAMETERS.into_iter().find(|path| self.has(path));
        if self.words.motion() == Motion::Translation {
            for path in [RADIUS].into_iter().chain(DIAMETERS) {
                if self.has(path) {
                    let message = "has no meaning in translation, where friction is mu F_n: remove it";
                    self.report(path, message);
                }
            }
            case.system.radius = 1.0;
            return;
        }
        self.fill_path(case, RADIUS);
        match (self.has(RADIUS), given) {
            (true, Some(first)) => self.radius_twice(first),
            (true, None) => {}
            (false, None) => self.report(
                RADIUS,
                "missing: r, the effective friction radius; give radius, or outer_diameter, inner_diameter and wear",
            ),
            (false, Some(_)) => {
                let sources = DIAMETERS.map(|path| self.source(path));
                let [
                    Some(Setting::Number(outer)),
                    Some(Setting::Number(inner)),
                    Some(Setting::Text(wear)),
                ] = sources
                else {
                    return;
                };
                if inner >= outer {
                    let message = format!("must be smaller than outer_diameter: {inner:?} m is not below {outer:?} m");
                    return self.report(DIAMETERS[1], message);
                }
                let radius = match wear.as_str() {
                    schema::UNIFORM_PRESSURE => uniform_pressure_radius(outer, inner),
                    _ => uniform_wear_radius(outer, inner),
                };
                if let Some(complaint) = Domain::Positive.complaint(radius) {
                    self.report(
                        DIAMETERS[0],
                        format!("gives a radius that {complaint}, but is {radius:?} m"),
                    );
                }
                case.system.radius = radius;
            }
        }
    }

    fn radius_twice(&mut self, diameter: &str) {
        // If only one of the two keys is an override, the message asks to change the override.
        let (overridden, path, other) = match (self.is_overridden(RADIUS), self.is_overridden(diameter)) {
            (false, true) => (true, diameter, RADIUS),
            (overridden, _) => (overridden, RADIUS, diameter),
        };
        let at = self.root.closest(other).place.show(&self.label);
        let remedy = match (overridden, path == RADIUS) {
            (false, _) => "keep either radius, or outer_diameter, inner_diameter and wear",
            (true, true) => "replace the whole table, contact={radius=...}",
            (true, false) => {
                "replace the whole table, contact={outer_diameter=..., inner_diameter=..., wear=\"uniform-wear\"}"
            }
        };
        self.report(
            path,
            format!("the radius is given twice, with {other} ({at}): {remedy}"),
        );
    }

    fn source(&mut self, path: &str) -> Option<Setting> {
        let key = schema::key_of(path)?;
        let read = match self.root.at(path) {
            Some(node) => single(key, &node.value, Motion::Rotation),
            None => Err(missing(key, Motion::Rotation)),
        };
        read.map_err(|message| self.report(path, message)).ok()
    }

    pub(super) fn contact_law(&mut self, case: &mut Case) {
        self.fill_path(case, FRICTION_LAW);
        if self.words.short || !self.has(REGULARISATION) {
            return;
        }
        if case.system.contact != ContactLaw::StickSlip {
            let message = "a contact with bristles is smooth already: remove regularisation, or change friction.law";
            return self.report(REGULARISATION, message);
        }
        // `check_names` has reported any other value.
        let given = self.root.at(REGULARISATION).map(|node| &node.value);
        if matches!(given, Some(CaseValue::Table(_))) {
            case.system.contact = ContactLaw::Regularised(Regularisation {
                function: Smoothing::Tanh,
                speed: f64::NAN,
            });
            for path in ["function", "speed"].map(|name| format!("{REGULARISATION}.{name}")) {
                if let (false, Some((key, ..))) = (self.has(&path), schema::find(&path, false).next()) {
                    self.report(&path, missing(key, self.words.motion()));
                }
            }
        }
    }

    pub(super) fn sticks(&self, case: &Case) -> bool {
        case.system.contact == ContactLaw::StickSlip && (self.words.short || !self.has(REGULARISATION))
    }

    pub(super) fn threshold(&mut self, case: &mut Case) {
        const PATH: &str = "friction.threshold";
        let default = match &case.system.contact {
            // The name of the law is misspelt, so that its default would be wrong.
            ContactLaw::StickSlip if self.is_reported("friction.law") => return,
            ContactLaw::StickSlip if !self.words.short && self.has(PATH) => {
                let message = "belongs to a contact without stick, a regularised one or one with bristles: a stick of this one \
                               needs no threshold; remove it";
                return self.report(PATH, message);
            }
            ContactLaw::StickSlip => 0.0,
            ContactLaw::Regularised(regularisation) => 10.0 * regularisation.speed,
            ContactLaw::Bristles(_) => case.system.law.number("scale").unwrap_or(f64::NAN) / 10.0,
        };
        if case.threshold.is_nan() {
            case.threshold = default;
        }
    }
}
