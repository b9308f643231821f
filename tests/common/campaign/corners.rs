//! Brakes that let go where the force is zero at a corner, or almost.

use super::brakes::{Brake, Drawn, Family, logarithmic, rounded};
use crate::common::random_brakes::Random;

use Family::*;

const FAMILIES: [Family; 7] = [
    ReleaseToZero,
    ReleaseBesideZero,
    TouchZero,
    CloseCorners,
    StepAtZero,
    PulseAtZero,
    KickAtZero,
];

/// Brake `index`, the same everywhere.
pub fn draw(index: u64) -> Drawn {
    let mut random = Random(700_000 + index);
    let r = &mut random;
    let family = FAMILIES[index as usize % FAMILIES.len()];
    let mut brake = Brake::wide(r, true, true, (1.5, 8.0));
    if r.next() < 0.3 {
        brake.axial_damping = rounded(logarithmic(r, 2000.0, 60_000.0), 1);
    }
    let mut table = brake.table.clone().expect("a table");
    let (open, again) = (table[3].0, table[5].1);
    let close = 10f64.powi(-(r.within(5.0, 14.0) as i32));
    let size = brake.kicks[0].1.abs();
    match family {
        ReleaseBesideZero => {
            let value = 10f64.powi(-(r.within(2.0, 18.0) as i32)) * if r.next() < 0.5 { 1.0 } else { -1.0 };
            (table[3].1, table[4].1) = (value, value);
        }
        TouchZero => {
            let later = rounded(open + r.within(0.001, 0.05), 5);
            table.truncate(4);
            table.extend([(later, again)]);
        }
        CloseCorners => {
            let force = rounded(r.within(1.0, 500.0), 1);
            match (r.next() * 3.0) as usize {
                0 => table.insert(3, (open - close, force)),
                1 => table.insert(4, (open + close, force)),
                _ => {
                    table[3].1 = force;
                    table.insert(4, (open + close, 0.0));
                }
            }
        }
        StepAtZero => {
            let value = if r.next() < 0.7 { again } else { -again };
            table.insert(4, (open, value));
            table[5].1 = value;
        }
        PulseAtZero => {
            table.insert(4, (open, again));
            table.insert(5, (open + close, again));
            table.insert(6, (open + close, 0.0));
        }
        KickAtZero => {
            let turning = -brake.speed_at(open) * r.within(0.5, 1.5);
            brake.kicks = vec![(format!("{open:?}"), if r.next() < 0.5 { turning } else { size })];
        }
        _ => {}
    }
    brake.end = table.last().expect("a corner").0 + 0.05;
    brake.table = Some(table);
    Drawn {
        family,
        settings: brake.settings(),
    }
}
