//! Pages of a periodic motion and of its certificate.

use super::{Page, PageTable, Report, below_changes, fixed};
use serde::Serialize;
use stickslip_analysis::cycle::{
    CertifiedCycle, CycleCertificate, CycleFile, EnclosedEvent, Multiplier, MultiplierKind, Orbit,
};
use stickslip_case::Motion;
use stickslip_system::quote::bound;

/// Report on a periodic motion.
#[derive(Debug, Serialize)]
pub struct CycleReport<'a> {
    status: &'static str,
    file: String,
    /// Origin of the case.
    case: &'a str,
    title: &'a str,
    /// Overrides of the case, in words.
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    changed: &'a [String],
    #[serde(skip)]
    motion: Motion,
    #[serde(flatten)]
    orbit: &'a Orbit,
}

impl<'a> CycleReport<'a> {
    /// Report on the motion of a file.
    pub fn new(found: &'a CycleFile) -> CycleReport<'a> {
        CycleReport {
            status: "complete",
            file: found.file.display().to_string(),
            case: &found.source,
            title: &found.title,
            changed: &found.changed,
            motion: found.motion,
            orbit: &found.orbit,
        }
    }
}

impl Report for CycleReport<'_> {
    fn page(&self) -> Page {
        let title = format!("{}: periodic motion", self.title);
        Page::new(title, below_changes(self.changed, ""))
            .with(numbers(self.orbit, self.motion))
            .with(&*self.file)
    }
}

/// Avoids "-0.000000000000".
fn plain(value: f64) -> f64 {
    if value.abs() < 5e-13 { 0.0 } else { value }
}

fn words(one: &Multiplier) -> String {
    let (real, imaginary) = (one.real, one.imaginary.abs());
    let sign = if one.imaginary < 0.0 { '-' } else { '+' };
    match one.kind {
        MultiplierKind::Free if imaginary == 0.0 => fixed(12).print(plain(real)),
        MultiplierKind::Free => format!("{real:.12} {sign} {imaginary:.12} i"),
        MultiplierKind::Along => "1 (along the motion)".to_owned(),
        MultiplierKind::Stick => "0 (exactly: a stick)".to_owned(),
    }
}

fn numbers(orbit: &Orbit, motion: Motion) -> PageTable {
    let [angle, speed] = match motion {
        Motion::Rotation => ["rad", "rad/s"],
        Motion::Translation => ["m", "m/s"],
    };
    let of_drive = match orbit.multiple {
        Some(1) => ", that of the drive".to_owned(),
        Some(multiple) => format!(", {multiple} periods of the drive"),
        None => String::new(),
    };
    let mut rows = vec![
        ("period", format!("{:.15} s{of_drive}", orbit.period)),
        ("stability", orbit.stability.name().to_owned()),
    ];
    let free = orbit.multipliers.iter().filter(|one| one.kind == MultiplierKind::Free);
    let sizes = free.map(|one| one.real.hypot(one.imaginary));
    if let Some(largest) = sizes.reduce(f64::max) {
        rows.push(("largest multiplier", format!("{largest:.12} (absolute value)")));
    }
    let has_position = orbit.position.1 >= orbit.position.0;
    if has_position {
        rows.push(("amplitude", format!("{:.14} {angle}", orbit.amplitude)));
    }
    if let Some((shortest, longest)) = orbit.shortest_stick.zip(orbit.longest_stick) {
        rows.push(("sticks", format!("{}, {shortest:.9} to {longest:.9} s", orbit.sticks)));
    }
    if let Some(nearest) = orbit.nearest {
        let (distance, time, border) = (nearest.distance, nearest.time, nearest.border.words());
        rows.push((
            "nearest change",
            format!("{distance:.6e} (relative) at {time:.6} s, to: {border}"),
        ));
    }
    let main = rows.len();
    // Only the first of several values has a name.
    let named = |name, values: Vec<String>| std::iter::once(name).chain(std::iter::repeat("")).zip(values);
    rows.extend(named("multipliers", orbit.multipliers.iter().map(words).collect()));
    if has_position {
        let (least, largest) = orbit.position;
        rows.push(("position", format!("{least:.14} to {largest:.14} {angle}")));
    }
    let (least, largest) = (plain(orbit.relative_velocity.0), plain(orbit.relative_velocity.1));
    if largest >= least {
        rows.push(("relative velocity", format!("{least:.12} to {largest:.12} {speed}")));
    }
    let events = orbit
        .events
        .iter()
        .map(|event| format!("{:.15} s {}", event.time, event.kind));
    rows.extend(named("events", events.collect()));
    if orbit.events.is_empty() {
        rows.push(("events", "none".to_owned()));
    }
    let (iterations, error) = (orbit.iterations, orbit.error);
    let newton = format!("{iterations} iterations, the last step {error:.1e} of the motion's size");
    rows.push(("Newton's method", newton));
    PageTable::pairs(rows).brief(main)
}

/// Rows of a certificate that are no details.
const MOST_EVENTS: usize = 8;

/// Report on the certificate of a cycle.
#[derive(Debug, Serialize)]
pub struct CycleCertificateReport<'a> {
    status: &'static str,
    file: String,
    title: &'a str,
    #[serde(flatten)]
    certificate: &'a CycleCertificate,
}

impl<'a> CycleCertificateReport<'a> {
    /// Report on the certificate of a file.
    pub fn new(certified: &'a CertifiedCycle) -> CycleCertificateReport<'a> {
        CycleCertificateReport {
            status: "complete",
            file: certified.file.display().to_string(),
            title: &certified.title,
            certificate: &certified.certificate,
        }
    }
}

impl Report for CycleCertificateReport<'_> {
    fn page(&self) -> Page {
        let c = self.certificate;
        let period = EnclosedEvent {
            kind: "period",
            time: c.period.clone(),
        };
        let table = PageTable::of(std::iter::once(&period).chain(&c.events))
            .text("", |row| row.kind)
            .text("s", |row| row.time.decimal.clone())
            .text("uncertainty, s", |row| bound(row.time.error, 1))
            .done()
            .brief(MOST_EVENTS);
        let (digits, corrections, contraction) = (c.digits_computed, c.corrections, c.contraction);
        let steps = match corrections {
            1 => "1 correction".to_owned(),
            _ => format!("{corrections} corrections, the last one {contraction:.0e} of the one before"),
        };
        let oracle = format!("exact solver with {digits} digits; {steps}");
        let title = format!("{}: the cycle is certified", self.title);
        Page::new(title, "")
            .with(table)
            .with(format!("{oracle}\n{}", self.file))
    }
}
