//! Keys of the contact that depend on each other: normal force, radius and contact law.

use super::document::CaseValue;
use super::reader::{Reader, missing};
use super::schema::{self, Domain, FRICTION_LAW};
use super::value::single;
use super::{Case, Motion, Setting};
use stickslip_system::model::contact::{uniform_pressure_radius, uniform_wear_radius};
use stickslip_system::model::system::{ContactLaw, Regularisation, Smoothing};

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
                let message = "missing: what presses the surfaces together; write normal_force = a number in N or \"500 lbf\" (or a \
                               signal), or give [axial] and [actuation]";
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
        if matches!(
            self.root.at(REGULARISATION).map(|node| &node.value),
            Some(CaseValue::Table(_))
        ) {
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
