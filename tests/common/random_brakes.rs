//! Brakes around that of the paper.

use stickslip::case::Override;

/// Numbers that are the same in every run and everywhere (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A whole number below `bound`.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.bits() % bound.max(1) as u64) as usize
    }

    /// A number in [0, 1).
    pub fn next(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [`low`, `high`).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// How many random brakes the long tests take: twenty, or what `STICKSLIP_BRAKES` says.
pub fn how_many() -> u64 {
    std::env::var("STICKSLIP_BRAKES").map_or(20, |text| {
        text.parse()
            .unwrap_or_else(|_| panic!("STICKSLIP_BRAKES = {text:?} is no number"))
    })
}

/// A brake around that of the paper, from a lower speed so that the run is short. Every fifth has no kick.
pub fn random_brake(index: u64) -> Vec<Override> {
    let mut random = Random(index);
    let speed = random.within(6.0, 15.0);
    let force = random.within(1500.0, 3000.0);
    let high = random.within(0.2, 0.4);
    let rise = random.within(0.01, 0.1);
    // Twice what the least friction takes to stop the rotor.
    let end = rise + 2.0 * 2.262 * speed / (high * 0.052388 * force);
    let kick = random_kick(&mut random);
    let kicks = if index % 5 == 4 { "[]".to_owned() } else { kick };
    let actuation = [
        format!("initial.speed={speed:.6}"),
        format!("actuation.force={force:.4}"),
        format!("actuation.rise_time={rise:.6}"),
    ];
    overrides(actuation, contact(&mut random, high, (0.5, 0.6), &kicks, end))
}

/// A brake around that of `release`: a table of force that lets go while the brake slides, so that the disks separate and
/// touch, and grips again with another force; mu_0 is above mu_s.
pub fn random_release(index: u64) -> Vec<Override> {
    let mut random = Random(1_000_000 + index);
    let speed = random.within(9.0, 14.0);
    let [first, second] = [0; 2].map(|_| random.within(1500.0, 3000.0));
    let (grip, release, again) = (
        random.within(0.01, 0.1),
        random.within(0.15, 0.3),
        random.within(0.35, 0.5),
    );
    let [fall, rise] = [0; 2].map(|_| random.within(2e-4, 2e-2));
    let high = random.within(0.2, 0.4);
    let end = again + rise + 2.0 * 2.262 * speed / (high * 0.052388 * second);
    let kick = random_kick(&mut random);
    let actuation = [
        format!("initial.speed={speed:.6}"),
        format!(
            "actuation.time=[0.0, {grip:.6}, {release:.6}, {:.6}, {again:.6}, {:.6}]",
            release + fall,
            again + rise
        ),
        format!("actuation.force=[0.0, {first:.3}, {first:.3}, 0.0, 0.0, {second:.3}]"),
    ];
    overrides(actuation, contact(&mut random, high, (0.45, 0.58), &kick, end))
}

/// A kick at the loss of stability, as a value of `perturbation`.
fn random_kick(random: &mut Random) -> String {
    let kick = 10f64.powf(random.within(-6.0, -2.0));
    format!("[{{time=\"instability\", relative_velocity={kick:.6e}}}]")
}

/// Friction, torsion, the given kicks, and few samples until `end` (s).
fn contact(random: &mut Random, high_speed: f64, low_speed: (f64, f64), kicks: &str, end: f64) -> [String; 11] {
    [
        format!("friction.high_speed={high_speed:.6}"),
        format!("friction.low_speed={:.6}", random.within(low_speed.0, low_speed.1)),
        format!("friction.decay={:.6}", random.within(2.5, 6.0)),
        format!("torsion.damping={:.6}", random.within(18.0, 28.0)),
        format!("torsion.stiffness={:.3}", random.within(5e6, 1e7)),
        format!("torsion.surface_inertia={:.8}", random.within(0.008, 0.015)),
        format!("perturbation={kicks}"),
        format!("output.end_time={end:.4}"),
        "output.interval=0.01".to_owned(),
        "output.window=[]".to_owned(),
        "output.around=none".to_owned(),
    ]
}

fn overrides<const N: usize>(actuation: [String; N], contact: [String; 11]) -> Vec<Override> {
    let all = actuation.iter().chain(&contact);
    all.map(|text| Override::parse(text).unwrap()).collect()
}
