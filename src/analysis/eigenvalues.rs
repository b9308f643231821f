//! The matrices whose eigenvalues are the modes of a state.

use crate::model::state::DYNAMIC;
use crate::model::torsion::TorsionModel;
use nalgebra::{DMatrix, SMatrix};

/// The leading block of a Jacobian, of `size` rows, with the twists scaled to the size of their rates: the eigenvalues stay,
/// their rounding shrinks.
pub(super) fn leading_block(
    jacobian: &SMatrix<f64, DYNAMIC, DYNAMIC>,
    size: usize,
    torsion: &TorsionModel,
) -> DMatrix<f64> {
    let weight = |k: usize| torsion.rate_weight(k);
    DMatrix::from_fn(size, size, |i, j| jacobian[(i, j)] * weight(i) / weight(j))
}

#[cfg(test)]
mod tests {
    use crate::analysis::Growth;
    use crate::case::{Case, CaseSource, Override};
    use crate::model::Parameters;
    use crate::record::MemoryRecorder;
    use crate::run::Run;

    /// A kick turns the slip against its rotor, and there it loses its stability. Smooth sliding with that sense does not
    /// exist, and its path has no length; followed all the same, it was one of NaN.
    #[test]
    fn regression_growth_where_a_kick_turns_the_slip() {
        let changes = [
            "axial.mass=5.540203543435869",
            "axial.stiffness=441101935.4355345",
            "axial.damping=49242.97470294818",
            "torsion.surface_inertia=0.7436364960809474",
            "torsion.rotor_inertia=81.78984040117506",
            "torsion.stiffness=986609.1472740709",
            "torsion.damping=69.54924980074699",
            "friction.breakaway=0.8181204716362555",
            "friction.low_speed=0.8181204716362555",
            "friction.high_speed=0.7296425720203465",
            "friction.decay=134.9667145864564",
            "initial.speed=90.82619909031959",
            "actuation={profile=\"ramp\",force=156.84880099552018,rise_time=12.059132431217796}",
            "perturbation=[{kind=\"kick\",time=19.904894134713516,relative_velocity=64.36110248123921},\
             {kind=\"kick\",time=17.188076480014825,relative_velocity=-114.30165801443698},\
             {kind=\"kick\",time=2.1635393315026006,relative_velocity=-5.333492895183853}]",
            "output.window=[]",
            "output.around=none",
            "output.interval=10",
            "output.end_time=21.81964290642463",
            "solver.method=series",
        ];
        let overrides = changes.map(|change| Override::parse(change).unwrap());
        let case = Case::parse(&CaseSource::built_in("paper-si").unwrap(), &overrides).unwrap();
        let mut recorder = MemoryRecorder::default();
        Run::new(&case).record(&mut recorder).start().unwrap();
        let disks = Parameters::of(&case.system).unwrap();
        let growth = Growth::of_run(&disks, &recorder.events, case.output.end_time);
        let growth = growth.expect("stability is lost");
        assert_eq!((growth.exponent, growth.smooth_end), (0.0, growth.instability));
    }
}
