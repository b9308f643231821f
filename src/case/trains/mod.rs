//! The general form of a case, `[rotor]` and `[stator]` in the place of `[torsion]`: two chains of any length.
//!
//! What it shares with the short form (`[axial]`, `[actuation]`, `[contact]`, `[friction]`, `[[perturbation]]`, `[solver]`,
//! `[output]`) is read through the keys of the schema, into a draft; the keys of its own are in `keys`.

mod conditions;
pub(super) mod keys;
mod places;
mod reader;
pub(super) mod resolved;
pub(super) mod signals;

use super::schema::Key;

pub(super) use places::{close_in_signal, is_signal, misplaced, slot};
pub(super) use reader::read;

/// Every key that only the general form has. Its others are those of [`super::schema::keys`], but for `[torsion]`.
pub fn train_keys() -> &'static [Key] {
    keys::KEYS
}
