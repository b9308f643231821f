//! The campaign's tables, in Markdown.

use super::{Fate, Held, Outcome};
use std::collections::BTreeMap;
use stickslip::analysis::certificate::Verdict;
use stickslip::record::EventKind;

/// What the default run promises of every event, s, where rounding allows it.
const PROMISE: f64 = 1e-9;

/// The same with `rtol = 1e-13`.
const FINE_PROMISE: f64 = 1e-11;

/// One row of figures.
#[derive(Default)]
struct Sums {
    events: usize,
    short: usize,
    /// Uncertainty over true error.
    widths: Vec<f64>,
    /// Largest error, s.
    worst: f64,
    fine_worst: f64,
    /// Events off by more than is promised and than rounding may do.
    over: usize,
    fine_over: usize,
    /// The same of `arkode`: by default and with `rtol = 1e-13`.
    arkode_worst: [f64; 2],
    arkode_over: [usize; 2],
}

impl Sums {
    fn add(&mut self, held: &Held, short: bool) {
        self.events += 1;
        self.short += usize::from(short);
        if held.error > 0.0 {
            self.widths.push(held.uncertainty / held.error);
        }
        self.worst = self.worst.max(held.error);
        self.over += usize::from(held.error > PROMISE.max(held.rounding));
        // A crossing of the margin may stand at a start, where CVODE sees it 1e-7 natural periods late.
        if let Some(error) = held.fine_error.filter(|_| held.kind.in_event_sequence()) {
            self.fine_worst = self.fine_worst.max(error);
            self.fine_over += usize::from(error > FINE_PROMISE.max(held.rounding));
        }
        for (k, promise) in [PROMISE, FINE_PROMISE].into_iter().enumerate() {
            let error = held.by_arkode[k];
            self.arkode_worst[k] = self.arkode_worst[k].max(error);
            self.arkode_over[k] += usize::from(error > promise.max(held.rounding));
        }
    }

    fn quantile(&self, share: f64) -> Option<f64> {
        let mut widths = self.widths.clone();
        widths.sort_by(f64::total_cmp);
        let last = widths.len().saturating_sub(1);
        widths.get(((share * widths.len() as f64) as usize).min(last)).copied()
    }

    fn width(&self, share: f64) -> String {
        self.quantile(share)
            .map_or_else(|| "-".to_owned(), |width| format!("{width:.1}"))
    }

    fn columns(&self) -> String {
        format!(
            "{} | {} | {} | {} | {:.0e} | {} | {:.0e} | {}",
            self.events,
            self.short,
            self.width(0.5),
            self.width(0.95),
            self.worst,
            self.over,
            self.fine_worst,
            self.fine_over
        )
    }
}

const COLUMNS: &str = "certified events | short | width over error, median | 95 % | largest error, s | over 1e-9 s | \
                       with `rtol = 1e-13`, s | over 1e-11 s";

/// Widths over errors that a certificate may have at the median and at 95 %: more would be coverage bought by width.
const WIDEST: [(f64, f64); 2] = [(0.5, 6.0), (0.95, 50.0)];

/// So many brakes have a median that one family does not decide.
const ENOUGH: usize = 16;

/// What the outcomes do not keep of the promised accuracy and widths, a sentence each.
pub fn broken_promises(outcomes: &[Outcome]) -> Vec<String> {
    let mut broken = Vec::new();
    let mut all = Sums::default();
    for outcome in outcomes {
        let mut own = Sums::default();
        for (held, short) in outcome.held.iter().zip(&outcome.short) {
            own.add(held, *short);
            all.add(held, *short);
        }
        for (method, over, worst, promise) in [
            ("the case", own.over, own.worst, PROMISE),
            ("the case", own.fine_over, own.fine_worst, FINE_PROMISE),
            ("arkode", own.arkode_over[0], own.arkode_worst[0], PROMISE),
            ("arkode", own.arkode_over[1], own.arkode_worst[1], FINE_PROMISE),
        ] {
            if over > 0 {
                let index = outcome.index;
                broken.push(format!(
                    "brake {index}: {over} events of {method} are off by up to {worst:.1e} s, more than {promise:e} s and than \
                     rounding"
                ));
            }
        }
    }
    for (share, most) in WIDEST {
        let width = all.quantile(share).unwrap_or(0.0);
        if outcomes.len() >= ENOUGH && width > most {
            broken.push(format!(
                "uncertainties are {width:.1} times the errors at {share}, more than {most}"
            ));
        }
    }
    broken
}

/// All tables. "Short" are converged events farther from the oracle than their uncertainty; "over" are those farther than
/// the promise and than the rounding that the certificate states.
pub fn tables(outcomes: &[Outcome]) -> String {
    let mut text = String::new();
    let mut fates: BTreeMap<Fate, usize> = BTreeMap::new();
    let (mut kinds, mut families) = (BTreeMap::new(), BTreeMap::new());
    let mut all = Sums::default();
    let mut brakes: BTreeMap<_, (usize, usize, usize)> = BTreeMap::new();
    for outcome in outcomes {
        *fates.entry(outcome.fate).or_default() += 1;
        let converged = outcome.fate == Fate::Certified(Verdict::Converged.name());
        let counts = brakes.entry(outcome.family).or_default();
        counts.0 += 1;
        counts.1 += usize::from(converged);
        counts.2 += usize::from(!outcome.faults.is_empty());
        let family = families.entry(outcome.family).or_insert_with(Sums::default);
        for (held, short) in outcome.held.iter().zip(&outcome.short) {
            let kind = EventKind::ALL.iter().position(|kind| *kind == held.kind);
            kinds.entry(kind).or_insert_with(Sums::default).add(held, *short);
            family.add(held, *short);
            all.add(held, *short);
        }
    }
    let rule = |columns: usize| format!("|{}\n", "---|".repeat(columns));
    let fates: Vec<String> = fates
        .iter()
        .map(|(fate, count)| match fate {
            Fate::Certified(verdict) => format!("{count} {verdict}"),
            Fate::Failed => format!("{count} failed"),
            Fate::NoOracle => format!("{count} without the oracle"),
        })
        .collect();
    let faults: usize = outcomes.iter().map(|outcome| outcome.faults.len()).sum();
    text += &format!(
        "\n{} brakes: {}; {faults} contradictions\n\n",
        outcomes.len(),
        fates.join(", ")
    );
    text += &format!("| event | {COLUMNS} |\n{}", rule(9));
    for (kind, sums) in &kinds {
        let name = kind.map_or("", |kind| EventKind::ALL[kind].name());
        text += &format!("| {name} | {} |\n", sums.columns());
    }
    text += &format!("| all | {} |\n", all.columns());
    let [worst, fine_worst] = all.arkode_worst;
    let [over, fine_over] = all.arkode_over;
    text += &format!(
        "\nThe events by `arkode`: largest error {worst:.0e} s, {over} over 1e-9 s; with `rtol = 1e-13` {fine_worst:.0e} s, \
         {fine_over} over 1e-11 s.\n"
    );
    text += &format!(
        "\n| family | brakes | converged | contradicted | {COLUMNS} |\n{}",
        rule(12)
    );
    for (family, sums) in &families {
        let (count, converged, faulty) = brakes[family];
        let name = family.name();
        text += &format!("| {name} | {count} | {converged} | {faulty} | {} |\n", sums.columns());
    }
    text
}
