//! The rows of a run as rows of the tables of a result file, which are in memory or in a file.

use super::ResultError;
use super::schema;
use crate::numerics::chebyshev::COEFFICIENTS;
use crate::record::{Cycle, Event, Piece, Recorder, RecorderError, Sample, Segment};

/// Positions in [`schema::tables`], and of the tables of the dense output after them.
pub(super) const TRAJECTORY: usize = 0;
pub(super) const EVENTS: usize = 1;
pub(super) const SEGMENTS: usize = 2;
pub(super) const STICK_SLIP: usize = 3;
pub(super) const PIECES: usize = 4;
pub(super) const PIECE_COEFFICIENTS: usize = 5;

/// Takes rows of tables. Each has a value for every variable of its table, in the order of the schema.
pub(super) trait TableRows {
    /// Number of rows of a table.
    fn rows(&self, table: usize) -> usize;

    /// Takes a row, whose parts are one after the other. One of a table that is not there is left out.
    fn take(&mut self, table: usize, row: &[&[f64]]) -> Result<(), ResultError>;

    /// What the row that comes next has beyond [`State`](crate::record::State).
    fn further(&mut self) -> &mut Vec<f64>;

    /// Whether samples and pieces are kept.
    fn stores_motion(&self) -> bool {
        true
    }

    /// Takes a row after its number in the table.
    fn numbered(&mut self, table: usize, row: &[f64]) -> Result<(), ResultError> {
        let number = self.rows(table) as f64;
        self.take(table, &[&[number], row])
    }
}

impl<T: TableRows> Recorder for T {
    fn further(&mut self, values: &[f64]) -> Result<(), RecorderError> {
        values.clone_into(TableRows::further(self));
        Ok(())
    }

    fn sample(&mut self, sample: &Sample) -> Result<(), RecorderError> {
        let further = std::mem::take(TableRows::further(self));
        let head = [sample.time, sample.mode.code().into(), sample.segment.into()];
        let (state, channels) = (sample.state.values(), sample.channels.values());
        let taken = self.take(TRAJECTORY, &[&head, &state, &channels, &further]);
        *TableRows::further(self) = further;
        Ok(taken?)
    }

    fn event(&mut self, event: &Event) -> Result<(), RecorderError> {
        let further = std::mem::take(TableRows::further(self));
        let head = [
            TableRows::rows(self, EVENTS) as f64,
            event.time,
            event.kind.code().into(),
            event.mode_after.code().into(),
            event.mode_after.sense().into(),
            event.segment.into(),
        ];
        let (before, after) = (event.before.values(), event.after.values());
        let taken = self.take(EVENTS, &[&head, &before, &after, &[event.internal_force], &further]);
        *TableRows::further(self) = further;
        Ok(taken?)
    }

    fn segment(&mut self, segment: &Segment) -> Result<(), RecorderError> {
        let row = [
            segment.start,
            segment.end,
            segment.mode.code().into(),
            solver_code(segment.solver).into(),
            segment.steps as f64,
            segment.rhs_evaluations as f64,
            segment.jacobian_evaluations as f64,
            segment.linear_solver_setups as f64,
            segment.error_test_failures as f64,
            segment.nonlinear_iterations as f64,
            segment.nonlinear_convergence_failures as f64,
            segment.root_evaluations as f64,
            segment.last_order.into(),
            segment.last_step,
        ];
        Ok(self.numbered(SEGMENTS, &row)?)
    }

    /// A piece has a row of coefficients for each degree.
    fn piece(&mut self, piece: &Piece<'_>) -> Result<(), RecorderError> {
        let row = [piece.start, piece.end, piece.mode.code().into(), piece.segment.into()];
        self.numbered(PIECES, &row)?;
        for degree in 0..COEFFICIENTS {
            let of_channels = piece.coefficients.iter().skip(degree).step_by(COEFFICIENTS);
            let row: Vec<f64> = of_channels.copied().collect();
            self.numbered(PIECE_COEFFICIENTS, &row)?;
        }
        Ok(())
    }

    fn cycle(&mut self, cycle: &Cycle) -> Result<(), RecorderError> {
        let row = [cycle.stick_duration, cycle.slip_duration, cycle.period];
        Ok(self.numbered(STICK_SLIP, &row)?)
    }

    fn stores_events(&self) -> bool {
        true
    }

    fn stores_motion(&self) -> bool {
        TableRows::stores_motion(self)
    }
}

/// "erk-NAME" counts as "erk".
fn solver_code(solver: &str) -> i8 {
    let named = |name: &str| schema::SOLVERS.iter().find(|flag| flag.1 == name).map(|flag| flag.0);
    named(solver)
        .or_else(|| named(solver.split('-').next().unwrap_or_default()))
        .unwrap_or(-1)
}
