//! The rows of the tables of a run, cell by cell in the order of the schema.

use super::schema;
use super::table::Cell;
use crate::model::Mode;
use crate::numerics::chebyshev::COEFFICIENTS;
use crate::record::{Cycle, Event, Piece, Sample, Segment};

/// Positions in `schema::tables()`.
pub(super) const TRAJECTORY: usize = 0;
pub(super) const EVENTS: usize = 1;
pub(super) const SEGMENTS: usize = 2;
pub(super) const STICK_SLIP: usize = 3;

/// A row of /trajectory, with the state beyond [`crate::record::State`].
pub(super) fn of_sample(sample: &Sample, further: &[f64]) -> impl Iterator<Item = Cell> {
    let head = [
        Cell::F64(sample.time),
        Cell::I8(sample.mode.code()),
        Cell::I32(index(sample.segment)),
    ];
    let rest = sample.state.values().into_iter().chain(sample.channels.values());
    head.into_iter()
        .chain(rest.chain(further.iter().copied()).map(Cell::F64))
}

/// A row of /events, with the state beyond [`crate::record::State`] before and after it.
pub(super) fn of_event(number: i32, event: &Event, further: &[f64]) -> impl Iterator<Item = Cell> {
    let head = [
        Cell::I32(number),
        Cell::F64(event.time),
        Cell::I8(event.kind.code()),
        Cell::I8(event.mode_after.code()),
        Cell::I8(Mode::sense(event.mode_after)),
        Cell::I32(index(event.segment)),
    ];
    let states = event.before.values().into_iter().chain(event.after.values());
    let rest = states.chain([event.internal_force]).chain(further.iter().copied());
    head.into_iter().chain(rest.map(Cell::F64))
}

/// A row of /segments.
pub(super) fn of_segment(number: i32, segment: &Segment) -> [Cell; 15] {
    [
        Cell::I32(number),
        Cell::F64(segment.start),
        Cell::F64(segment.end),
        Cell::I8(segment.mode.code()),
        Cell::I8(solver_code(segment.solver)),
        Cell::I64(count(segment.steps)),
        Cell::I64(count(segment.rhs_evaluations)),
        Cell::I64(count(segment.jacobian_evaluations)),
        Cell::I64(count(segment.linear_solver_setups)),
        Cell::I64(count(segment.error_test_failures)),
        Cell::I64(count(segment.nonlinear_iterations)),
        Cell::I64(count(segment.nonlinear_convergence_failures)),
        Cell::I64(count(segment.root_evaluations)),
        Cell::I32(index(segment.last_order)),
        Cell::F64(segment.last_step),
    ]
}

/// A row of /stick_slip.
pub(super) fn of_cycle(number: i32, cycle: &Cycle) -> [Cell; 4] {
    [
        Cell::I32(number),
        Cell::F64(cycle.stick_duration),
        Cell::F64(cycle.slip_duration),
        Cell::F64(cycle.period),
    ]
}

/// A row of /dense.
pub(super) fn of_piece(number: i32, piece: &Piece<'_>) -> [Cell; 5] {
    [
        Cell::I32(number),
        Cell::F64(piece.start),
        Cell::F64(piece.end),
        Cell::I8(piece.mode.code()),
        Cell::I32(index(piece.segment)),
    ]
}

/// A row of /dense/coefficients: those of one degree.
pub(super) fn of_coefficients(number: i32, piece: &Piece<'_>, degree: usize) -> impl Iterator<Item = Cell> {
    let of_channels = piece.coefficients.iter().skip(degree).step_by(COEFFICIENTS);
    std::iter::once(Cell::I32(number)).chain(of_channels.map(|c| Cell::F64(*c)))
}

fn index(value: u32) -> i32 {
    i32::try_from(value).unwrap_or(i32::MAX)
}

pub(super) fn count(value: u64) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

/// "erk-NAME" counts as "erk".
fn solver_code(solver: &str) -> i8 {
    let named = |name: &str| schema::SOLVERS.iter().find(|flag| flag.1 == name).map(|flag| flag.0);
    named(solver)
        .or_else(|| named(solver.split('-').next().unwrap_or_default()))
        .unwrap_or(-1)
}
