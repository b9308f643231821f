//! Linear between points.

use super::Profile;

/// Through the points (time, value), linear in between. The first value holds before, the last after them.
#[derive(Debug, Clone, PartialEq)]
pub struct Table<T = f64> {
    /// s, increasing strictly.
    pub time: Vec<T>,
    /// One for each time, in the unit of what it drives.
    pub value: Vec<T>,
}

impl<T> Table<T> {
    /// As [`super::Signal::try_map`].
    pub(super) fn try_map<U, E>(
        &self,
        number: &mut impl FnMut(&'static str, Option<usize>, &T) -> Result<U, E>,
    ) -> Result<Table<U>, E> {
        let mut list = |name: &'static str, values: &[T]| -> Result<Vec<U>, E> {
            let numbers = values.iter().enumerate();
            numbers.map(|(index, value)| number(name, Some(index), value)).collect()
        };
        Ok(Table {
            time: list("time", &self.time)?,
            value: list("value", &self.value)?,
        })
    }
}

impl Profile for Table {
    const NAME: &'static str = "table";

    fn blank() -> Table {
        Table {
            time: Vec::new(),
            value: Vec::new(),
        }
    }

    /// What lies before t = 0 is cut off.
    fn stretches(&self) -> Vec<(f64, f64, f64)> {
        let Table { time, value } = self;
        let mut stretches = Vec::with_capacity(time.len() + 1);
        if time[0] > 0.0 {
            stretches.push((0.0, value[0], 0.0));
        }
        for k in 0..time.len() {
            let slope = match time.get(k + 1) {
                Some(next) => (value[k + 1] - value[k]) / (next - time[k]),
                None => 0.0,
            };
            if time.get(k + 1).is_some_and(|&next| next <= 0.0) {
                continue;
            }
            let start = time[k].max(0.0);
            stretches.push((start, value[k] + slope * (start - time[k]), slope));
        }
        stretches
    }
}
