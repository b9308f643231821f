//! A case as TOML in SI, at full precision.

use super::schema::{self, FRICTION_LAW, Key};
use super::{Case, Motion};
use stickslip_system::model::system::ContactLaw;

pub(super) fn write(case: &Case) -> String {
    let mut case = case.clone();
    let short = case.is_short();
    let mut text = String::new();
    let keys = schema::in_order(short);
    for table in keys.chunk_by(|one, other| one.split().0 == other.split().0) {
        let name = table[0].split().0;
        let array = name.strip_suffix("[]");
        for index in 0..table[0].count(&case) {
            let mut heading = match array {
                Some(array) => format!("\n[[{array}]]\n"),
                None if name.is_empty() => String::new(),
                None => format!("\n[{name}]\n"),
            };
            for key in table {
                if let Some(value) = value(&mut case, key, index, short) {
                    text += &std::mem::take(&mut heading);
                    text += &format!("{} = {value} # {}\n", key.split().1, about(&case, key, short));
                }
            }
        }
    }
    text
}

fn value(case: &mut Case, key: &Key, index: usize, short: bool) -> Option<String> {
    let is_written = match key.path {
        "contact.radius" => case.motion() == Motion::Rotation,
        "contact.breakaway_test" => case.system.contact == ContactLaw::StickSlip,
        "initial.speed" | "perturbation[].kind" => short,
        "output.dense" => case.output.follow.dense,
        _ => true,
    };
    let value = key.places(case, index).first().filter(|_| is_written)?.get()?.toml();
    (value != "[]").then_some(value)
}

fn about(case: &Case, key: &Key, short: bool) -> String {
    let bristles = matches!(case.system.contact, ContactLaw::Bristles(_));
    let description = match key.path {
        FRICTION_LAW if bristles => "bristles; below, the law g of their limits",
        "friction.viscous" if bristles => "sigma_2, rise of the friction coefficient with sliding speed",
        "perturbation[].time" if !short => "when the kick comes",
        "perturbation[].relative_velocity" if !short => "delta, jump of omega_r",
        _ => key.description,
    };
    match key
        .dimension()
        .map(|dimension| case.motion().dimension(dimension).unit())
    {
        None | Some("1") => description.to_owned(),
        Some(unit) => format!("{description} [{unit}]"),
    }
}
