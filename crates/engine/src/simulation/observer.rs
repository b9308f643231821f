//! Observer of a run: turns states into rows of the record.

use super::follower::{Follower, FollowerState};
use super::options::{OutputOptions, SolverOptions};
use super::readings::Readings;
use super::report::{Grazing, RunReport, SolverWork};
use super::sampling::{SampleTimes, TimesAround};
use crate::error::{Error, ErrorKind, ErrorPlace};
use crate::hybrid::{Guard, Observer, SegmentReport, Start, StateAt, SystemLocation};
use crate::sundials::Counters;
use std::ops::ControlFlow;
use std::time::Instant;
use stickslip_system::model::Mode;
use stickslip_system::record::{
    Channels, Event, EventDigest, EventKind, RecordedChannel, Recorder, Sample, Segment, State, channel,
};
use stickslip_system::watch::Watch;

pub(super) struct Recording<'a, R> {
    readings: R,
    recorder: &'a mut dyn Recorder,
    watch: &'a dyn Watch,
    times: SampleTimes,
    around: Option<TimesAround>,
    follower: Option<Follower>,
    inside: Vec<f64>,
    steps: bool,
    last_sample: f64,
    segments: u32,
    counted: usize,
    work_perturbation: f64,
    report: RunReport,
    /// Largest wall time (s), its start, and whether it has run out.
    wall_time: Option<f64>,
    started: Instant,
    out_of_time: bool,
    further: Vec<f64>,
}

impl ErrorPlace {
    fn at(time: f64, location: &SystemLocation) -> ErrorPlace {
        let mode = location.mode;
        ErrorPlace { time, mode }
    }

    fn check(self, what: &str, value: f64) -> Result<(), Error> {
        match value.is_finite() {
            true => Ok(()),
            false => Err(self.error(
                ErrorKind::Overflow,
                "a value is not finite",
                format!(": {what} is {value}"),
            )),
        }
    }

    fn check_all(self, channels: &[RecordedChannel], values: &[f64]) -> Result<(), Error> {
        let mut pairs = channels.iter().zip(values);
        pairs.try_for_each(|(channel, value)| self.check(channel.name, *value))
    }

    fn check_state(self, state: &State) -> Result<(), Error> {
        self.check_all(State::CHANNELS, &state.values())
    }
}

fn with_history(mut c: Channels, work_perturbation: f64, initial_energy: f64) -> Channels {
    c.work_perturbation = work_perturbation;
    c.energy_residual = c.energy_kinetic + c.energy_elastic + c.dissipated_friction + c.dissipated_damping
        - c.work_applied
        - c.work_perturbation
        - initial_energy;
    c
}

impl<'a, R: Readings> Recording<'a, R> {
    pub(super) fn new(
        readings: R,
        digest: EventDigest,
        (solver, output): (&SolverOptions, &OutputOptions),
        recorder: &'a mut dyn Recorder,
        watch: &'a dyn Watch,
        start: &Start,
    ) -> Self {
        let (_, channels) = readings.read(start.time, &start.location, &start.state);
        Recording {
            readings,
            recorder,
            watch,
            times: SampleTimes::new(output),
            around: None,
            follower: None,
            inside: Vec::new(),
            steps: output.steps,
            last_sample: f64::NEG_INFINITY,
            segments: 0,
            counted: 0,
            work_perturbation: 0.0,
            report: RunReport {
                digest,
                initial_energy: channels.energy_kinetic + channels.energy_elastic,
                ..RunReport::default()
            },
            wall_time: solver.max_wall_time,
            started: Instant::now(),
            out_of_time: false,
            further: Vec::new(),
        }
    }

    /// Records the motion where `output` asks for it. The periods (s) are the natural and the shortest one; `foreseen`
    /// are the predicted events of the run.
    pub(super) fn follow(
        &mut self,
        output: &OutputOptions,
        dimension: usize,
        (period, shortest): (f64, f64),
        rtol: f64,
        foreseen: &[Event],
    ) {
        self.follower = Follower::new(output, shortest, rtol, self.recorder);
        self.inside = vec![0.0; dimension];
        if self.recorder.stores_motion() {
            self.around = TimesAround::new(output, period, foreseen);
        }
    }

    pub(super) fn flush(&mut self) -> Result<(), Error> {
        self.follower
            .as_mut()
            .map_or(Ok(()), |follower| follower.finish(self.recorder))
    }

    pub fn begin_at(&mut self, t: f64) {
        self.times.begin_at(t);
    }

    pub(super) fn in_time(&self, time: f64, location: &SystemLocation) -> Result<(), Error> {
        match self.wall_time.filter(|_| self.out_of_time) {
            Some(budget) => {
                let what = format!("the budget of {budget} s of wall time is used up");
                Err(ErrorPlace::at(time, location).error(ErrorKind::OutOfTime, &what, ""))
            }
            None => Ok(()),
        }
    }

    pub(super) fn into_report(self) -> RunReport {
        self.report
    }

    fn complete(&mut self, place: ErrorPlace, channels: Channels) -> Result<Channels, Error> {
        let channels = with_history(channels, self.work_perturbation, self.report.initial_energy);
        place.check_all(Channels::CHANNELS, &channels.values())?;
        let c = &channels;
        let held = c.energy_kinetic + c.energy_elastic + c.dissipated_friction + c.dissipated_damping;
        let report = &mut self.report;
        report.energy_residual = report.energy_residual.max(c.energy_residual.abs());
        report.energy_turnover = report.energy_turnover.max(held.abs()).max(c.work_applied.abs());
        report.dissipated_energy = c.dissipated_friction;
        Ok(channels)
    }

    fn record(&mut self, t: f64, location: &SystemLocation, y: &[f64]) -> Result<(), Error> {
        if t <= self.last_sample {
            return Ok(());
        }
        self.last_sample = t;
        let finished = t >= self.report.end && self.times_are_over();
        let segment = if finished {
            self.segments.saturating_sub(1)
        } else {
            self.segments
        };
        let (state, channels) = self.readings.read(t, location, y);
        let place = ErrorPlace::at(t, location);
        place.check_state(&state)?;
        let channels = self.complete(place, channels)?;
        let sample = Sample {
            time: t,
            mode: location.mode,
            segment,
            state,
            channels,
        };
        self.further.clear();
        self.readings.further(t, location, y, &mut self.further);
        let taken = self.recorder.further(&self.further);
        taken
            .and_then(|()| self.recorder.sample(&sample))
            .map_err(Error::recorder)
    }

    /// Hands over a state without a row, so that the record does not depend on it.
    fn strobe(&mut self, t: f64, location: &SystemLocation, y: &[f64]) -> Result<(), Error> {
        let (state, _) = self.readings.read(t, location, y);
        self.further.clear();
        self.readings.further(t, location, y, &mut self.further);
        let taken = self.recorder.further(&self.further);
        let strobe = taken.and_then(|()| self.recorder.strobe(t, location.mode, state.relative_velocity));
        strobe.map_err(Error::recorder)
    }

    pub(super) fn end_segment(
        &mut self,
        span: (f64, f64),
        location: &SystemLocation,
        solver: &'static str,
        c: &Counters,
    ) -> Result<(), Error> {
        let (start, end) = span;
        if let Some(follower) = &mut self.follower {
            follower.segment_ended();
        }
        self.segments += 1;
        self.report.end = end;
        let work = &mut self.report.work;
        let position = work.iter().position(|w| w.solver == solver).unwrap_or_else(|| {
            work.push(SolverWork {
                solver,
                segments: 0,
                simulated_time: 0.0,
                steps: 0,
                rhs_evaluations: 0,
                jacobian_evaluations: 0,
            });
            work.len() - 1
        });
        let row = &mut work[position];
        row.segments += 1;
        row.simulated_time += end - start;
        row.steps += c.steps;
        row.rhs_evaluations += c.rhs_evaluations;
        row.jacobian_evaluations += c.jacobian_evaluations;
        let segment = Segment {
            start,
            end,
            mode: location.mode,
            solver,
            resolved: Some(location.resolved),
            counters: *c,
        };
        self.recorder.segment(&segment).map_err(Error::recorder)
    }

    /// Whether the present sample is the run's last, which comes after the report of the last segment.
    fn times_are_over(&self) -> bool {
        self.segments > 0 && self.report.end == self.times.end_time
    }
}

impl<R: Readings> Observer for Recording<'_, R> {
    fn next_sample_time(&self) -> f64 {
        let around = self.around.as_ref().map_or(f64::INFINITY, |around| around.next);
        self.times.next.min(around).min(self.recorder.next_strobe())
    }

    fn sample(&mut self, t: f64, location: &SystemLocation, y: &[f64]) -> Result<(), Error> {
        if t == self.recorder.next_strobe() {
            self.strobe(t, location, y)?;
            let around = self.around.as_ref().map_or(f64::INFINITY, |around| around.next);
            if t < self.times.next.min(around) {
                return Ok(());
            }
        }
        if t == self.times.next {
            self.times.advance();
        }
        if let Some(around) = &mut self.around {
            around.taken(t);
        }
        self.record(t, location, y)
    }

    fn wants_steps(&self) -> bool {
        self.steps
    }

    fn step(&mut self, t: f64, location: &SystemLocation, y: &[f64]) -> Result<(), Error> {
        self.record(t, location, y)
    }

    fn wants_inside(&self) -> bool {
        self.follower.as_ref().is_some_and(Follower::wants_inside)
    }

    fn inside(&mut self, from: f64, to: f64, location: &SystemLocation, at: &mut StateAt<'_>) -> Result<(), Error> {
        let Some(follower) = &mut self.follower else {
            return Ok(());
        };
        let (readings, y) = (&self.readings, &mut self.inside);
        let (work_perturbation, initial_energy) = (self.work_perturbation, self.report.initial_energy);
        let mut row = |t: f64| {
            at(t, y)?;
            let (state, channels) = readings.read(t, location, y);
            let channels = with_history(channels, work_perturbation, initial_energy);
            let values = channel::all().zip(state.values().into_iter().chain(channels.values()));
            let stored = values.filter(|(channel, _)| channel.product.is_none());
            let mut row: Vec<f64> = stored.map(|(_, value)| value).collect();
            readings.further(t, location, y, &mut row);
            Ok(row)
        };
        let mut at = FollowerState {
            mode: location.mode,
            segment: self.segments,
            row: &mut row,
        };
        follower.inside(from, to, &mut at, self.recorder)
    }

    fn event(
        &mut self,
        t: f64,
        kind: EventKind,
        before: (&SystemLocation, &[f64]),
        after: (&SystemLocation, &[f64]),
    ) -> Result<(), Error> {
        if kind == EventKind::Kick {
            self.work_perturbation +=
                self.readings.kinetic_energy(t, after.0, after.1) - self.readings.kinetic_energy(t, before.0, before.1);
        }
        self.counted += usize::from(kind.in_event_sequence());
        if let Some(around) = &mut self.around {
            around.event(t, kind);
        }
        let (state_after, _) = self.readings.read(t, after.0, after.1);
        // After a kick beyond the end of its mode, friction has the sense that the reversal begins.
        let reversed = f64::from(after.0.mode.sense()) * state_after.relative_velocity < 0.0;
        let mode = match after.0.mode {
            Mode::SlipForward if kind == EventKind::Kick && reversed => Mode::SlipBackward,
            Mode::SlipBackward if kind == EventKind::Kick && reversed => Mode::SlipForward,
            mode => mode,
        };
        let location = match mode == after.0.mode {
            true => *after.0,
            false => SystemLocation {
                mode,
                sense: mode.sense(),
                ..*after.0
            },
        };
        let (_, channels) = self.readings.read(t, &location, after.1);
        let place = ErrorPlace::at(t, before.0);
        self.complete(place, channels)?;
        let event = Event {
            time: t,
            kind,
            mode_after: after.0.mode,
            segment: self.segments.saturating_sub(1),
            before: self.readings.read(t, before.0, before.1).0,
            after: state_after,
            internal_force: self.readings.internal_force(t, before.0, before.1),
        };
        place.check_state(&event.before)?;
        place.check_state(&event.after)?;
        place.check("internal_force", event.internal_force)?;
        if !self.recorder.stores_events() {
            self.report.events.push(event);
        }
        let cycle = self.report.digest.push(&event);
        self.further.clear();
        self.readings.further(t, before.0, before.1, &mut self.further);
        self.readings.further(t, after.0, after.1, &mut self.further);
        let taken = self.recorder.further(&self.further);
        let taken = taken.and_then(|()| self.recorder.event(&event));
        let taken = taken.and_then(|()| cycle.map_or(Ok(()), |cycle| self.recorder.cycle(&cycle)));
        taken.map_err(Error::recorder)
    }

    fn grazed(&mut self, t: f64, _: &SystemLocation, guard: &Guard) {
        if !guard.ends_mode {
            return;
        }
        let first = Grazing {
            count: 0,
            time: t,
            guard: guard.name,
        };
        self.report.grazing.get_or_insert(first).count += 1;
    }

    fn segment(&mut self, report: &SegmentReport) -> Result<(), Error> {
        let span = (report.start, report.end);
        self.end_segment(span, &report.location, report.solver.name(), &report.counters)
    }

    fn progress(&mut self, t: f64, location: &SystemLocation) -> ControlFlow<()> {
        if let Some(most) = self.wall_time
            && self.started.elapsed().as_secs_f64() > most
        {
            self.out_of_time = true;
            return ControlFlow::Break(());
        }
        let (end_time, mode, events) = (self.times.end_time, location.mode.name(), self.counted);
        let what = format_args!("t = {t:.6} s of {end_time} s, {mode}, {events} events");
        self.watch.at(t, end_time, what)
    }
}
