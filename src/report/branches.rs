//! Report of a continuation: branches, special points, curves.

use super::{NumberFormat, Page, PageTable, Report, fixed, range};
use serde::Serialize;
use stickslip_analysis::continuation::{
    Branch, BranchPoint, ContinuationReport, ContinuationStudy, Special, SpecialCurve,
};

#[derive(Serialize)]
pub(crate) struct BranchesReport<'a> {
    status: &'static str,
    file: String,
    study: String,
    title: &'a str,
    /// Name of the varied number.
    number: &'a str,
    points: usize,
    branches: Vec<BranchSummary>,
    special_points: Vec<SpecialPoint>,
    curves: Vec<CurveSummary>,
    remarks: &'a [String],
    /// s.
    wall_time: f64,
    #[serde(skip)]
    of: (&'a ContinuationStudy, &'a ContinuationReport),
}

#[derive(Serialize)]
struct BranchSummary {
    what: &'static str,
    points: usize,
    end: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    parent: Option<usize>,
}

#[derive(Serialize)]
struct SpecialPoint {
    branch: usize,
    point: usize,
    kind: &'static str,
    value: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    period: Option<f64>,
    #[serde(skip)]
    words: &'static str,
}

#[derive(Serialize)]
struct CurveSummary {
    kind: &'static str,
    points: usize,
}

impl<'a> BranchesReport<'a> {
    pub fn new(study: &'a ContinuationStudy, report: &'a ContinuationReport, wall_time: f64) -> BranchesReport<'a> {
        let explored = &report.explored;
        let branch = |branch: &Branch| BranchSummary {
            what: if branch.steady { "steady" } else { "cycle" },
            points: branch.points.len(),
            end: branch.end.name(),
            parent: branch.parent.map(|parent| parent.0),
        };
        let special = |(branch, point, at): (usize, usize, &BranchPoint)| SpecialPoint {
            branch,
            point,
            kind: at.special.map_or("", Special::name),
            value: at.value,
            period: Some(at.period).filter(|period| !period.is_nan()),
            words: at.special.map_or("", Special::words),
        };
        let points = explored.branches.iter().enumerate().flat_map(|(branch, of)| {
            let points = of.points.iter().enumerate();
            points.map(move |(point, at)| (branch, point, at))
        });
        let curve = |curve: &SpecialCurve| CurveSummary {
            kind: curve.special.name(),
            points: curve.points.len(),
        };
        BranchesReport {
            status: super::status(explored.interrupted),
            file: report.file.display().to_string(),
            study: study.head.source.label(),
            title: &study.head.title,
            number: &study.axes[0].name,
            points: explored.points(),
            branches: explored.branches.iter().map(branch).collect(),
            special_points: points.filter(|one| one.2.special.is_some()).map(special).collect(),
            curves: explored.curves.iter().map(curve).collect(),
            remarks: &explored.remarks,
            wall_time,
            of: (study, report),
        }
    }
}

/// Rows of a table that are no details.
const MOST_ROWS: usize = 4;

impl Report for BranchesReport<'_> {
    fn page(&self) -> Page {
        let (study, report) = self.of;
        let branches = match self.branches.len() {
            1 => "1 branch".to_owned(),
            many => format!("{many} branches"),
        };
        let key = |axis: usize| study.axes[axis].keys[0].as_str();
        let special_points = (!self.special_points.is_empty()).then(|| special_points(&self.special_points, key(0)));
        let curves = &report.explored.curves;
        let curves = (!curves.is_empty()).then(|| curve_table(curves, [key(0), key(1)]));
        Page::new(
            self.title,
            format!("{} points of {branches} in {:.1} s", self.points, self.wall_time),
        )
        .with_all(special_points)
        .with_all(curves)
        .with_all(self.remarks.iter().map(|remark| format!("warning: {remark}")))
        .details([branch_table(&report.explored.branches)])
        .with(&*self.file)
    }
}

fn branch_table(branches: &[Branch]) -> PageTable {
    let what = |branch: &Branch| match (branch.steady, branch.multiple) {
        (true, _) => "steady sliding".to_owned(),
        (false, Some(multiple @ 2..)) => format!("cycles of {multiple} periods"),
        (false, _) => "cycles".to_owned(),
    };
    let end = |branch: &Branch, end: usize| range(branch.points.iter().map(|point| point.value))[end];
    PageTable::of(branches.iter().enumerate())
        .count("branch", |(index, _)| index)
        .text("of", |(_, branch)| what(branch))
        .count("from branch", |(_, branch)| {
            branch.parent.map_or_else(String::new, |parent| parent.0.to_string())
        })
        .count("points", |(_, branch)| branch.points.len())
        .number("from", "", fixed(9), |(_, branch)| end(branch, 0))
        .number("to", "", fixed(9), |(_, branch)| end(branch, 1))
        .text("ends", |(_, branch)| branch.end.words())
        .done()
}

fn special_points(points: &[SpecialPoint], key: &str) -> PageTable {
    PageTable::of(points)
        .count("branch", |one| one.branch)
        .count("point", |one| one.point)
        .number(key, "", fixed(13), |one| one.value)
        .number("period", "s", fixed(12).or(""), |one| one.period)
        .text("special point", |one| one.words)
        .done()
        .brief(MOST_ROWS)
}

fn curve_table(curves: &[SpecialCurve], keys: [&str; 2]) -> PageTable {
    const NUMBER: NumberFormat = fixed(9);
    let end = |curve: &SpecialCurve, k: usize, end: usize| range(curve.points.iter().map(|point| point.values[k]))[end];
    PageTable::of(curves)
        .text("curve of", |curve| curve.special.name())
        .count("points", |curve| curve.points.len())
        .number(keys[0], "", NUMBER, |curve| end(curve, 0, 0))
        .number("to", "", NUMBER, |curve| end(curve, 0, 1))
        .number(keys[1], "", NUMBER, |curve| end(curve, 1, 0))
        .number("to", "", NUMBER, |curve| end(curve, 1, 1))
        .done()
        .brief(MOST_ROWS)
}
