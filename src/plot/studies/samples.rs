//! The distribution of a quantity over a sample, and its dependence on each axis.

use super::data::{StudyColumn, StudyData};
use super::{refused, title};
use crate::Error;
use crate::plot::figure::{Area, Axis, Curve, CurveStyle, Figure, Panel};
use crate::plot::style::{BLACK, BLUE, SKY};
use stickslip_analysis::analysis::distribution::{Distribution, PERCENTILES};

/// Number of drawn axes, those with the strongest dependence.
const AXES: usize = 6;

/// Histogram with percentiles, and dots over each varying axis, by decreasing rank correlation.
pub(super) fn figure(data: &StudyData, quantity: &StudyColumn) -> Result<Figure, Error> {
    let Some(distribution) = Distribution::of(&quantity.values, quantity.whole) else {
        let name = &quantity.name;
        return refused(
            &data.path,
            format!("no run has a value of {name}, which leaves nothing to draw; name another with --quantity"),
        );
    };
    let mut panels = vec![histogram(quantity, &distribution)];
    let mut axes: Vec<(f64, &StudyColumn)> = data
        .axes
        .iter()
        .filter(|axis| axis.varies())
        .map(|axis| (rank_correlation(&axis.values, &quantity.values), axis))
        .collect();
    axes.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    let all = axes.len();
    for (correlation, axis) in axes.into_iter().take(AXES) {
        let points: Vec<(f64, f64)> = axis
            .values
            .iter()
            .zip(&quantity.values)
            .filter(|(_, value)| value.is_finite())
            .map(|(x, y)| (*x, *y))
            .collect();
        let style = CurveStyle::of_many(points.len(), 400, CurveStyle::OpenPoints);
        let dots = Curve::line("", BLUE, points).styled(style);
        let mut panel = Panel::new(axis.axis(), quantity.axis(), vec![dots]);
        if axis.flags.is_empty() {
            panel.caption = format!("rank correlation {}", crate::plot::scale::number(correlation, 2));
        }
        panels.push(panel);
    }
    let mut words = format!("{}, {} runs", quantity.long_name, distribution.count);
    if distribution.without > 0 {
        words += &format!(" and {} without", distribution.without);
    }
    if all > AXES {
        words += &format!("; the {AXES} of {all} axes that matter most");
    }
    Ok(Figure::new(
        format!("samples-{}", quantity.name),
        title((&data.title, data.complete), &words),
        panels,
    ))
}

fn histogram(quantity: &StudyColumn, distribution: &Distribution) -> Panel {
    let pieces = distribution
        .bars
        .iter()
        .filter(|bar| bar.2 > 0)
        .map(|&(from, to, count)| vec![(from, 0.0, count as f64), (to, 0.0, count as f64)]);
    let highest = distribution.bars.iter().map(|bar| bar.2).max().unwrap_or(0) as f64;
    let outline = distribution.bars.iter().flat_map(|&(from, to, count)| {
        let count = count as f64;
        [(from, 0.0), (from, count), (to, count), (to, 0.0)]
    });
    let percentile = |wish: f64| {
        let place = PERCENTILES.iter().position(|percent| *percent == wish).unwrap_or(0);
        distribution.percentiles[place]
    };
    let upright = |x: f64| vec![(x, 0.0), (x, 1.05 * highest)];
    let ends = vec![upright(percentile(5.0)), upright(percentile(95.0))];
    let ends = Curve::pieces("5 % and 95 %", BLACK, ends).styled(CurveStyle::Dashed);
    let median = Curve::line("median", BLACK, upright(percentile(50.0)));
    let outline = Curve::line("", BLUE, outline.collect()).styled(CurveStyle::Thin);
    let mut panel = Panel::new(
        quantity.axis(),
        Axis::new("runs", "1").ranging(0.0, 1.1 * highest),
        vec![outline, ends, median],
    );
    panel.areas = vec![Area::unnamed(SKY, pieces.collect())];
    panel
}

/// Spearman's coefficient over the points that have both values; 0 if one of the two does not vary.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> f64 {
    let both: Vec<(f64, f64)> = x
        .iter()
        .zip(y)
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .map(|(x, y)| (*x, *y))
        .collect();
    let ranks = |value: fn(&(f64, f64)) -> f64| {
        let mut order: Vec<usize> = (0..both.len()).collect();
        order.sort_by(|&a, &b| value(&both[a]).total_cmp(&value(&both[b])));
        let mut ranks = vec![0.0; both.len()];
        let mut start = 0;
        while start < order.len() {
            let own = value(&both[order[start]]);
            let end = start + order[start..].iter().take_while(|&&k| value(&both[k]) == own).count();
            // Equal values share their mean rank.
            for &k in &order[start..end] {
                ranks[k] = 0.5 * (start + end - 1) as f64;
            }
            start = end;
        }
        ranks
    };
    let (a, b) = (ranks(|point| point.0), ranks(|point| point.1));
    let mean = 0.5 * (both.len().max(1) - 1) as f64;
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
    let size = (product(&a, &a) * product(&b, &b)).sqrt();
    if size > 0.0 { product(&a, &b) / size } else { 0.0 }
}
