//! From torsional states to the rows of the record.

use super::brake::{Brake, Location};
use super::digest::EventDigest;
use super::record::{Channels, Event, EventKind, Recorder, Sample, Segment, State};
use super::sampling::SampleTimes;
use super::{OutputOptions, Progress, RunReport, SolverWork};
use crate::hybrid::{Observer, ObserverError, SegmentReport};
use crate::model::torsion::index::{
    DAMPING_LOSS, FRICTION_LOSS, ROTOR_SPEED, ROTOR_TWIST, ROTOR_TWIST_RATE, SLIP, STATOR_TWIST, STATOR_TWIST_RATE,
};
use crate::model::{Axial, Mode, Parameters};
use std::ops::ControlFlow;

/// Feeds a [`Recorder`] from the automaton.
pub(super) struct Recording<'a> {
    brake: &'a Brake,
    axial: Axial,
    recorder: &'a mut dyn Recorder,
    control: &'a mut dyn FnMut(Progress) -> ControlFlow<()>,
    times: SampleTimes,
    steps: bool,
    last_sample: f64,
    /// Segments that have ended.
    segments: u32,
    counted: usize,
    work_perturbation: f64,
    report: RunReport,
}

impl<'a> Recording<'a> {
    pub(super) fn new(
        brake: &'a Brake,
        parameters: &Parameters,
        output: &OutputOptions,
        recorder: &'a mut dyn Recorder,
        control: &'a mut dyn FnMut(Progress) -> ControlFlow<()>,
        start: &[f64],
    ) -> Self {
        Recording {
            brake,
            axial: parameters.axial,
            recorder,
            control,
            times: SampleTimes::new(output),
            steps: output.steps,
            last_sample: f64::NEG_INFINITY,
            segments: 0,
            counted: 0,
            work_perturbation: 0.0,
            report: RunReport {
                digest: EventDigest::new(parameters),
                initial_energy: brake.torsion.kinetic_energy(start),
                ..RunReport::default()
            },
        }
    }

    pub(super) fn into_report(self) -> RunReport {
        self.report
    }

    fn state(&self, t: f64, mode: Mode, y: &[f64]) -> State {
        let axial = self.brake.axial.at(t);
        let (u, v, slip) = (y[ROTOR_TWIST], y[STATOR_TWIST], y[SLIP]);
        let v_dot = y[STATOR_TWIST_RATE];
        // In stick it is zero by the mode, not by a difference of two rounded speeds.
        let w = if mode == Mode::Stick {
            0.0
        } else {
            self.brake.torsion.relative_velocity(y)
        };
        State {
            z: axial.displacement,
            z_dot: axial.velocity,
            theta: u + v + slip,
            theta_dot: y[ROTOR_SPEED],
            phi1: v,
            phi1_dot: v_dot,
            phi2: v + slip,
            phi2_dot: w + v_dot,
            rotor_twist: u,
            rotor_twist_rate: y[ROTOR_TWIST_RATE],
            relative_velocity: w,
            slip_displacement: slip,
        }
    }

    fn channels(&mut self, t: f64, mode: Mode, y: &[f64]) -> Channels {
        let (axial, torsion) = (self.brake.axial.at(t), &self.brake.torsion);
        let normal_force = if mode == Mode::Separated {
            0.0
        } else {
            axial.pressing_force.max(0.0)
        };
        let transmitted_torque = torsion.transmitted_torque(y);
        let Axial { mass, stiffness, .. } = self.axial;
        let energy_kinetic = torsion.kinetic_energy(y) + 0.5 * mass * axial.velocity * axial.velocity;
        let energy_elastic = torsion.elastic_energy(y) + 0.5 * stiffness * axial.displacement * axial.displacement;
        let dissipated_friction = y[FRICTION_LOSS];
        let dissipated_damping = y[DAMPING_LOSS] + axial.dissipated;
        let energy_residual = energy_kinetic + energy_elastic + dissipated_friction + dissipated_damping
            - axial.work
            - self.work_perturbation
            - self.report.initial_energy;
        self.report.energy_residual = self.report.energy_residual.max(energy_residual.abs());
        Channels {
            applied_force: axial.force,
            normal_force,
            friction_torque: match mode {
                Mode::Separated => 0.0,
                Mode::Stick => transmitted_torque,
                Mode::SlipForward | Mode::SlipBackward => {
                    torsion.sliding_torque(f64::from(mode.sense()), y, normal_force)
                }
            },
            transmitted_torque,
            energy_kinetic,
            energy_elastic,
            work_applied: axial.work,
            work_perturbation: self.work_perturbation,
            dissipated_friction,
            dissipated_damping,
            energy_residual,
        }
    }

    fn record(&mut self, t: f64, location: &Location, y: &[f64]) -> Result<(), ObserverError> {
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
        let channels = self.channels(t, location.mode, y);
        let sample = Sample {
            time: t,
            mode: location.mode,
            segment,
            state: self.state(t, location.mode, y),
            channels,
        };
        self.recorder.sample(&sample)
    }

    /// Whether the sample under way is the run's last, which stands after the last segment has been reported.
    fn times_are_over(&self) -> bool {
        self.segments > 0 && self.report.end == self.times.end()
    }
}

impl Observer<Location, EventKind> for Recording<'_> {
    fn next_sample_time(&self) -> f64 {
        self.times.next()
    }

    fn sample(&mut self, t: f64, location: &Location, y: &[f64]) -> Result<(), ObserverError> {
        self.times.advance();
        self.record(t, location, y)
    }

    fn wants_steps(&self) -> bool {
        self.steps
    }

    fn step(&mut self, t: f64, location: &Location, y: &[f64]) -> Result<(), ObserverError> {
        self.record(t, location, y)
    }

    fn event(
        &mut self,
        t: f64,
        kind: EventKind,
        before: (&Location, &[f64]),
        after: (&Location, &[f64]),
    ) -> Result<(), ObserverError> {
        if kind == EventKind::Kick {
            let torsion = &self.brake.torsion;
            self.work_perturbation += torsion.kinetic_energy(after.1) - torsion.kinetic_energy(before.1);
        }
        self.counted += usize::from(kind.in_mode_word());
        self.channels(t, after.0.mode, after.1);
        let event = Event {
            time: t,
            kind,
            mode_after: after.0.mode,
            segment: self.segments.saturating_sub(1),
            before: self.state(t, before.0.mode, before.1),
            after: self.state(t, after.0.mode, after.1),
            internal_force: self.brake.torsion.transmitted_torque(before.1) / self.brake.torsion.contact.radius,
        };
        if !self.recorder.stores_events() {
            self.report.events.push(event);
        }
        let cycle = self.report.digest.push(&event);
        self.recorder.event(&event)?;
        cycle.map_or(Ok(()), |cycle| self.recorder.cycle(&cycle))
    }

    fn segment(&mut self, report: &SegmentReport<Location>) -> Result<(), ObserverError> {
        self.segments += 1;
        self.report.end = report.end;
        let c = &report.counters;
        let solver = report.solver.name();
        let work = &mut self.report.work;
        let position = work.iter().position(|w| w.solver == solver).unwrap_or_else(|| {
            work.push(SolverWork {
                solver,
                segments: 0,
                time: 0.0,
                steps: 0,
                rhs_evaluations: 0,
                jacobian_evaluations: 0,
            });
            work.len() - 1
        });
        let row = &mut work[position];
        row.segments += 1;
        row.time += report.end - report.start;
        row.steps += c.steps;
        row.rhs_evaluations += c.rhs_evaluations;
        row.jacobian_evaluations += c.jacobian_evaluations;
        self.recorder.segment(&Segment {
            start: report.start,
            end: report.end,
            mode: report.location.mode,
            solver,
            steps: c.steps,
            rhs_evaluations: c.rhs_evaluations,
            jacobian_evaluations: c.jacobian_evaluations,
            linear_solver_setups: c.linear_solver_setups,
            error_test_failures: c.error_test_failures,
            nonlinear_iterations: c.nonlinear_iterations,
            nonlinear_convergence_failures: c.nonlinear_convergence_failures,
            root_evaluations: c.root_evaluations,
            last_order: c.last_order,
            last_step: c.last_step,
        })
    }

    fn progress(&mut self, t: f64, location: &Location) -> ControlFlow<()> {
        (self.control)(Progress {
            time: t,
            mode: location.mode,
            events: self.counted,
        })
    }
}
