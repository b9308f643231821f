//! Report of a sweep: its points, failures and boundaries, and how quantities of a sample are distributed.

use super::{NumberFormat, Page, PageTable, Report, below_changes, exponent, fixed};
use crate::Error;
use crate::plot::studies::{self, Choice, StudyColumn};
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;
use stickslip_analysis::analysis::distribution::{Distribution, PERCENTILES};
use stickslip_analysis::sweep::{Boundaries, CurveBranch, Design, Shard, Study, SweepReport};
use stickslip_files::{StudyFile, schema};

#[derive(Serialize)]
pub(crate) struct SweepSummary<'a> {
    status: &'static str,
    file: String,
    #[serde(serialize_with = "label")]
    study: &'a Study,
    title: &'a str,
    digest: String,
    /// Finished points, and points run by this command.
    points: u64,
    run_now: u64,
    failed: u64,
    failures: Vec<PointFailure<'a>>,
    jobs: usize,
    /// s.
    wall_time: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    shard: Option<Shard>,
    /// Runs that end before their result is certain: a lasting stick, or a periodic motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    unfinished: Option<u64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    curves: Vec<BoundarySummary>,
    #[serde(skip)]
    report: &'a SweepReport,
}

#[derive(Serialize)]
struct PointFailure<'a> {
    point: u64,
    message: &'a str,
}

/// A connected line of a boundary, in the units of its axes.
#[derive(Serialize)]
struct BoundarySummary {
    plane: String,
    points: usize,
    x_range: [f64; 2],
    y_range: [f64; 2],
    nose: Option<[f64; 2]>,
}

fn label<S: Serializer>(study: &Study, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&study.head.source.label())
}

impl<'a> SweepSummary<'a> {
    pub fn new(study: &'a Study, shard: Option<Shard>, report: &'a SweepReport, jobs: usize, wall_time: f64) -> Self {
        let failures = report.failures.iter();
        let curves = report.boundaries.as_ref().map(|found| curves(study, found));
        SweepSummary {
            status: super::status(report.interrupted),
            file: report.file.display().to_string(),
            study,
            title: &study.head.title,
            digest: study.digest(),
            points: report.points,
            run_now: report.run_now,
            failed: report.failed,
            failures: failures
                .map(|(point, message)| PointFailure { point: *point, message })
                .collect(),
            jobs,
            wall_time,
            shard,
            unfinished: report.unfinished,
            curves: curves.unwrap_or_default(),
            report,
        }
    }

    fn work(&self) -> String {
        let (points, wall_time) = (self.points, self.wall_time);
        let rate = self.run_now as f64 / wall_time;
        match self.run_now {
            0 => format!("{points} points, none of them run now"),
            1 if points == 1 => format!("1 point in {wall_time:.1} s"),
            now if now == points => format!("{now} points in {wall_time:.1} s, {rate:.1} a second"),
            now => format!("{points} points, {now} of them now in {wall_time:.1} s, {rate:.1} a second"),
        }
    }

    fn failures(&self) -> Option<String> {
        let PointFailure { point, message } = self.failures.first()?;
        Some(match self.failed {
            1 => format!("1 point failed, {point}: {message}"),
            failed => format!("{failed} points failed, the first {point}: {message}"),
        })
    }

    /// The failures that the document lists, if there are several.
    fn all_failures(&self) -> Option<PageTable> {
        (self.failures.len() > 1).then(|| {
            PageTable::of(&self.failures)
                .count("point", |failure| failure.point)
                .text("failed by", |failure| failure.message)
                .done()
        })
    }

    fn unfinished(&self) -> Option<String> {
        let runs = match self.unfinished.filter(|&count| count > 0)? {
            1 => "1 run ends".to_owned(),
            many => format!("{many} runs end"),
        };
        let why = match self.study.slows_down() {
            true => {
                "before a stick that lasts (final_stick_time is NaN), so that sticks may be missing; a later output.end_time \
                 would show them"
            }
            false => {
                "before the motion repeats itself or settles (motion is not-periodic, or stuck in a stick shorter than twice \
                 the longest before it); a later output.end_time may show the attractor"
            }
        };
        Some(format!("{runs} {why}"))
    }

    fn no_boundary(&self) -> Option<String> {
        let Design::Boundary(spec) = &self.study.design else {
            return None;
        };
        let ([columns, rows], criterion) = (spec.nodes, spec.criterion.text());
        (self.report.boundaries.is_some() && self.curves.is_empty()).then(|| {
            format!(
                "no boundary: between the runs of the first grid, {columns} x {rows}, {criterion} changes nowhere; widen the \
                 ranges, or raise count"
            )
        })
    }

    fn distributions(&self) -> Vec<(StudyColumn, Distribution)> {
        if !matches!(self.study.design, Design::Rows(_)) || self.shard.is_some() {
            return Vec::new();
        }
        let file = StudyFile::open(&self.report.file, schema::SWEEP_FORMAT).map_err(Error::from);
        let found = file.and_then(|file| studies::distributions(&file, &Choice::default()));
        found.unwrap_or_default()
    }
}

impl Report for SweepSummary<'_> {
    fn page(&self) -> Page {
        let title = match self.shard {
            Some(shard) => format!("{}, shard {shard}", self.title),
            None => self.title.to_owned(),
        };
        let lines = std::iter::once(self.work()).chain(self.failures());
        let lines: Vec<String> = lines.chain(self.unfinished()).chain(self.no_boundary()).collect();
        let table = (!self.curves.is_empty()).then(|| curve_table(&self.curves));
        let distributions = self.distributions();
        let page = Page::new(title, below_changes(&self.study.head.changed, lines.join("\n")))
            .with_all(table)
            .with_all((!distributions.is_empty()).then(|| summary(&distributions)))
            .details(self.all_failures());
        distributions.iter().fold(page, distribution).with(&*self.file)
    }
}

fn curves(study: &Study, boundaries: &Boundaries) -> Vec<BoundarySummary> {
    let Design::Boundary(spec) = &study.design else {
        return Vec::new();
    };
    let plane = |plane: usize| {
        let values = study.axes.iter().zip(&boundaries.planes[plane]).enumerate();
        let outside = values.filter(|(k, _)| !spec.plane.contains(k));
        let words = outside.map(|(_, (axis, value))| format!("{} = {}", axis.keys[0], value.word()));
        words.collect::<Vec<_>>().join(", ")
    };
    let curves = boundaries.curves.iter().map(|curve| {
        let nose = curve.points.iter().find(|point| point.branch == CurveBranch::Fold);
        let [x_range, y_range] = [0, 1].map(|k| super::range(curve.points.iter().map(|point| point.middle()[k])));
        BoundarySummary {
            plane: plane(curve.plane),
            points: curve.points.len(),
            x_range,
            y_range,
            nose: nose.map(|point| point.middle()),
        }
    });
    curves.collect()
}

fn curve_table(curves: &[BoundarySummary]) -> PageTable {
    const NUMBER: NumberFormat = fixed(6).or("");
    PageTable::of(curves)
        .text("curve", |curve| curve.plane.clone())
        .count("points", |curve| curve.points)
        .number("x from", "", NUMBER, |curve| curve.x_range[0])
        .number("to", "", NUMBER, |curve| curve.x_range[1])
        .number("y from", "", NUMBER, |curve| curve.y_range[0])
        .number("to", "", NUMBER, |curve| curve.y_range[1])
        .number("fold x", "", NUMBER, |curve| curve.nose.map(|fold| fold[0]))
        .number("y", "", NUMBER, |curve| curve.nose.map(|fold| fold[1]))
        .done()
        .brief(MOST_ROWS)
}

/// Distribution of a quantity as a document.
#[derive(Serialize)]
pub(crate) struct DistributionSummary<'a> {
    bars: &'a [(f64, f64, usize)],
    count: usize,
    largest: f64,
    least: f64,
    mean: f64,
    percentiles: BTreeMap<String, f64>,
    quantity: &'a str,
    unit: &'a str,
    without: usize,
}

impl<'a> DistributionSummary<'a> {
    pub fn new((quantity, found): &'a (StudyColumn, Distribution)) -> Self {
        let percentiles = PERCENTILES.iter().zip(found.percentiles);
        DistributionSummary {
            bars: &found.bars,
            count: found.count,
            largest: found.largest,
            least: found.least,
            mean: found.mean,
            percentiles: percentiles
                .map(|(percent, value)| (percent.to_string(), value))
                .collect(),
            quantity: &quantity.name,
            unit: &quantity.units,
            without: found.without,
        }
    }
}

/// Rows of a table of curves or quantities that are no details.
const MOST_ROWS: usize = 8;

/// How each quantity is distributed, in one line.
pub(crate) fn summary(all: &[(StudyColumn, Distribution)]) -> PageTable {
    let percentile =
        |place: usize| move |(_, found): &(StudyColumn, Distribution)| digits(found).print(found.percentiles[place]);
    PageTable::of(all)
        .text("", |(quantity, _)| format!("{}{}", quantity.name, unit(quantity)))
        .count("runs", |(_, found)| found.count)
        .count("without", |(_, found)| found.without)
        .only_if(all.iter().any(|(_, found)| found.without > 0))
        .count("least", |(_, found)| digits(found).print(found.least))
        .count("5 %", percentile(1))
        .count("median", percentile(3))
        .count("95 %", percentile(5))
        .count("largest", |(_, found)| digits(found).print(found.largest))
        .done()
        .brief(MOST_ROWS)
}

fn unit(quantity: &StudyColumn) -> String {
    match &*quantity.units {
        "1" => String::new(),
        units => format!(" ({units})"),
    }
}

/// These digits resolve 1/100 of the interquartile range.
fn digits(found: &Distribution) -> NumberFormat {
    let spread = found.percentiles[4] - found.percentiles[2];
    let size = found.least.abs().max(found.largest.abs());
    if (1e-3..1e6).contains(&size) && (spread > 0.0 || size >= 1.0) {
        let step = if spread > 0.0 { spread } else { size };
        fixed((2.0 - step.log10().floor()).clamp(0.0, 12.0) as usize)
    } else {
        exponent(4)
    }
}

/// Length of the longest bar of a histogram, in characters.
const BAR: usize = 40;

/// Adds how a quantity is distributed, as details: percentiles and a histogram.
pub(crate) fn distribution(page: Page, (quantity, found): &(StudyColumn, Distribution)) -> Page {
    let unit = unit(quantity);
    let without = match found.without {
        0 => String::new(),
        without => format!(", {without} without a value"),
    };
    let digits = digits(found);
    let heads = PERCENTILES.iter().zip(found.percentiles);
    let heads = heads.map(|(percent, value)| (format!("{percent} %"), value));
    let columns = std::iter::once(("least".to_owned(), found.least)).chain(heads);
    let columns = columns.chain([("largest".to_owned(), found.largest), ("mean".to_owned(), found.mean)]);
    let numbers = columns.fold(PageTable::of([()]), |table, (head, value)| {
        table.number(&head, "", digits, |()| value)
    });
    let most = found.bars.iter().map(|bar| bar.2).max().unwrap_or(1).max(1);
    let histogram = PageTable::of(&found.bars)
        .number("from", "", digits, |bar| bar.0)
        .number("to", "", digits, |bar| bar.1)
        .count("runs", |bar| bar.2)
        // Every bar that is not empty is visible.
        .text("", |bar| "#".repeat((bar.2 * BAR).div_ceil(most)))
        .done();
    let (name, runs) = (&quantity.name, found.count);
    page.details([numbers.done().titled(format!("{name}{unit}: {runs} runs{without}"))])
        .below([histogram])
}
