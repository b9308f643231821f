//! Results of other solvers, in all supported formats.

mod csv;
pub(super) mod events;
mod hdf5;
mod mapping;
mod npz;
mod rows;
mod table;

pub use mapping::{Mapping, TimeOffset};
pub use rows::Block;
pub(super) use rows::Rows;

use super::diagnosis::{CaseDifference, case_differences};
use super::reference::Physics;
use super::resolution::{Clock, ClockWatch, Digital, Rounding};
use super::statistics::ComparedAttractor;
use super::vocabulary::Known;
use super::{Channel, CompareError, Found, saved_case};
use csv::CsvReader;
use hdf5::{foreign_table, own_table};
use npz::npz_table;
use rows::Supply;
use std::path::{Path, PathBuf};
use stickslip_case::quantity::Dimension;
use stickslip_files::{ForeignFile, Reason, ResultFile, check_sound};
use stickslip_system::model::system::Pressing;
use stickslip_system::quote::shown;
use table::{CandidateSource, CandidateTable, LeftOut, MOST_NAMED, listed};

const HEAD: u64 = 512;

const TIME_NAMES: [&str; 4] = ["time", "t", "times", "trajectory/time"];

#[derive(Debug, Default)]
pub(crate) struct Candidate {
    pub path: PathBuf,
    /// "result file", "HDF5", "CSV", "NPZ" or "events table".
    pub format: &'static str,
    table: Option<CandidateTable>,
    columns: Vec<String>,
    pub clock: Clock,
    /// The first times show that they are rounded.
    clock_rounds: bool,
    digital: Vec<Digital>,
    supplies: Vec<Supply>,
    direct: Vec<Channel>,
    /// Contents of the file that cannot be read, and channel names that are no column.
    left_out: Vec<LeftOut>,
    /// Events of the sequence, if the file has an event table.
    pub events: Option<Vec<Found>>,
    pub events_rounding: Option<Rounding>,
    /// Differences between its case and the reference's; `None` unless it is a result file.
    differences: Option<Vec<CaseDifference>>,
    pub attractor: Option<ComparedAttractor>,
}

impl Candidate {
    /// Opens a candidate. Fails if its format is unknown, if it is damaged, if it lacks a time column, if it has
    /// neither events nor a relative velocity, or if the mapping names a missing column.
    pub fn open(path: &Path, mapping: &Mapping, physics: &Physics) -> Result<Candidate, CompareError> {
        let source = CandidateSource::open(path)?;
        let head = source.head(HEAD)?;
        if head.starts_with(b"\x89HDF") {
            refuse_pipe(&source)?;
            match ResultFile::open(path) {
                Ok(file) => {
                    check_sound(path)?;
                    return Candidate::own(path, file, physics);
                }
                Err(error) if matches!(error.reason, Reason::NotAResult(_)) => {}
                Err(error) => return Err(error.into()),
            }
        }
        let (format, table) = table_of(source, &head)?;
        Candidate::foreign(path, format, table, mapping, physics)
    }

    fn own(path: &Path, file: ResultFile, physics: &Physics) -> Result<Candidate, CompareError> {
        let case = saved_case(path, &file)?;
        let events = file.events()?;
        if case.motion() != physics.vocabulary().motion() {
            let what = "is a run of another motion than the reference: one is of rotation, one of translation";
            return Err(CompareError::whole(path, what, "compare runs of one motion"));
        }
        let axial = matches!(case.system.pressing, Pressing::Axial { .. });
        let is_there = |channel: &Channel| match channel {
            _ if channel.is_axial() => axial,
            _ => file.column(&channel.name(), 0..0).is_ok(),
        };
        let mut candidate = Candidate::empty(path, "result file");
        candidate.columns.push("time".to_owned());
        for channel in physics.vocabulary().channels().filter(is_there) {
            candidate.take(channel, channel.name().into_owned(), 1.0);
        }
        candidate.events = Some(events::own(path, &events, case.system.radius)?);
        candidate.differences = Some(case_differences(&physics.case, &case));
        candidate.attractor = ComparedAttractor::of_file(&file)?;
        candidate.table = Some(own_table(file, &candidate.columns));
        Ok(candidate)
    }

    fn empty(path: &Path, format: &'static str) -> Candidate {
        Candidate {
            path: path.to_owned(),
            format,
            ..Candidate::default()
        }
    }

    fn take(&mut self, channel: Channel, column: String, factor: f64) {
        self.supplies.push(Supply::direct(channel, factor, self.columns.len()));
        self.columns.push(column);
        self.direct.push(channel);
    }

    fn foreign(
        path: &Path,
        format: &'static str,
        table: CandidateTable,
        mapping: &Mapping,
        physics: &Physics,
    ) -> Result<Candidate, CompareError> {
        let stated = (physics.kinds_are_events && table.has_texts("kind")).then(|| mapping.clone().stated());
        let mapping = stated.as_ref().unwrap_or(mapping);
        let mut candidate = Candidate::empty(path, format);
        candidate.left_out.clone_from(&table.left_out);
        for channel in physics.vocabulary().channels() {
            if let Some((name, factor)) = candidate.find(&table, channel, mapping, physics)? {
                if candidate.columns.is_empty() {
                    candidate.find_time(&table, mapping)?;
                }
                candidate.take(channel, name, factor);
            }
        }
        rows::derive(&mut candidate.supplies, physics);
        if let Some((events, rounding)) = events::find(&table, mapping, candidate.direct.is_empty())? {
            candidate.events = Some(events);
            candidate.events_rounding = rounding;
        }
        if candidate.direct.is_empty() {
            if candidate.events.is_none() {
                let what = format!("no column is known as a channel; there are {}", candidate.there(&table));
                let remedy = "say which column is what, such as --column relative_velocity=NAME:rad/s, or in a mapping";
                return Err(CompareError::whole(path, what, remedy));
            }
            candidate.format = "events table";
        } else {
            candidate.look_at_digits(&table)?;
            candidate.table = Some(table);
        }
        if candidate.events.is_none() && !candidate.has(Channel::RELATIVE_VELOCITY) {
            let given: Vec<_> = candidate.direct.iter().map(|c| c.name()).collect();
            let what = format!(
                "has neither events nor a relative velocity to find them by, but {}{}",
                given.join(", "),
                candidate.without()
            );
            let speeds = physics.vocabulary().surface_speeds();
            let remedy = format!("add relative_velocity, or {speeds}, or a table of events");
            return Err(CompareError::whole(path, what, &remedy));
        }
        Ok(candidate)
    }

    /// Estimates the rounding of the file's numbers from its first rows.
    fn look_at_digits(&mut self, table: &CandidateTable) -> Result<(), CompareError> {
        let of_texts = table.roundings(&self.columns)?;
        let mut first = vec![Vec::new(); self.columns.len()];
        let mut pass = table.pass(&self.columns)?;
        pass(&mut first)?;
        let columns = first.iter().zip(&of_texts);
        self.digital = columns
            .map(|(values, of_texts)| Digital::of(values, *of_texts))
            .collect();
        let single = Some(Rounding::Single).filter(|single| first[0].len() > 2 && single.hold(&first[0]));
        self.clock.rounding = of_texts[0].or(single);
        let mut watch = ClockWatch::default();
        if let Some(rounding) = self.clock.rounding {
            first[0].iter().for_each(|&raw| watch.add(rounding, raw));
        }
        self.clock_rounds = watch.is_rounded();
        // A sum has the rounding of its largest terms, which may come later.
        let is_rounded = |column: usize| self.digital[column].rounding.is_some();
        let mut computed = self.supplies.iter().filter(|supply| supply.is_computed());
        if computed.any(|supply| supply.columns().any(is_rounded)) {
            while pass(&mut first).is_ok() && !first[0].is_empty() {
                for (digital, values) in self.digital.iter_mut().zip(&first) {
                    let finite = values.iter().filter(|value| value.is_finite());
                    digital.largest = finite.fold(digital.largest, |largest, value| largest.max(value.abs()));
                }
            }
        }
        Ok(())
    }

    fn find_time(&mut self, table: &CandidateTable, mapping: &Mapping) -> Result<(), CompareError> {
        let mapped = mapping.time.as_ref();
        let name = match mapped {
            Some(column) => Some(table.mapped("time", &column.name)?),
            None => table.only("time", &TIME_NAMES, &|_| false)?,
        };
        let name = name.ok_or_else(|| {
            self.leave_out(table, &TIME_NAMES);
            let what = format!("has no column of times; there are {}", self.there(table));
            let remedy = "name it with --column time=NAME or in a mapping";
            CompareError::whole(&self.path, what, remedy)
        })?;
        self.clock.factor = table.factor(&name, mapped, Dimension::Time)?;
        self.columns.push(name);
        Ok(())
    }

    /// The column of a channel with its factor to SI, by the mapping or by name.
    fn find(
        &mut self,
        table: &CandidateTable,
        channel: Channel,
        mapping: &Mapping,
        physics: &Physics,
    ) -> Result<Option<(String, f64)>, CompareError> {
        let vocabulary = physics.vocabulary();
        let mut of_mapping = mapping.channels.iter();
        let mapped = of_mapping.find(|(known, _)| vocabulary.canonical(*known) == Some(channel));
        let mapped = mapped.map(|(_, column)| column);
        let taken = |name: &str| mapping.channels.iter().any(|(_, column)| column.name == name);
        let own = channel.name();
        let names = vocabulary.names(channel).iter().map(String::as_str);
        // If a file names the bristles by their own name, its z is the axial position.
        let is_axial = |name: &str| name == "z" && name != own && table.has(&own);
        let is_name = |name: &&str| !taken(name) && !is_axial(name);
        let names: Vec<&str> = names.filter(is_name).collect();
        let name = match mapped {
            Some(column) => Some(table.mapped(&own, &column.name)?),
            None => {
                let of_file = |name: &&&str| vocabulary.is_own_name(channel, name) && table.has(name);
                let mut same = names.iter().filter(of_file);
                match (same.next(), same.next()) {
                    (Some(first), Some(other)) => {
                        let others = [other].into_iter().chain(same);
                        self.left_out.extend(others.map(|name| LeftOut {
                            name: (*name).to_owned(),
                            why: format!("is another name of {first}, whose column is compared"),
                            remedy: format!("leave out {first} to compare it"),
                        }));
                        Some((*first).to_owned())
                    }
                    _ => table.only(&own, &names, &taken)?,
                }
            }
        };
        let Some(name) = name else {
            self.leave_out(table, &names);
            return Ok(None);
        };
        let factor = table.factor(&name, mapped, vocabulary.dimension(channel))?;
        Ok(Some((name, factor)))
    }

    fn leave_out(&mut self, table: &CandidateTable, names: &[&str]) {
        let found = names.iter().filter_map(|name| table.unread(name));
        for left_out in found {
            if !self.left_out.iter().any(|known| known.name == left_out.name) {
                self.left_out.push(left_out);
            }
        }
    }

    pub fn left_out(&self) -> impl Iterator<Item = (&str, &str)> {
        self.left_out.iter().map(|one| (&*one.name, &*one.why))
    }

    fn without(&self) -> String {
        let one = |one: &LeftOut| format!("{} {} ({})", shown(&one.name), one.why, one.remedy);
        let all: Vec<String> = self.left_out.iter().take(MOST_NAMED).map(one).collect();
        let more = if self.left_out.len() > MOST_NAMED { "; ..." } else { "" };
        match all.is_empty() {
            true => String::new(),
            false => format!("; left out: {}{more}", all.join("; ")),
        }
    }

    fn there(&self, table: &CandidateTable) -> String {
        listed(&table.names()) + &self.without()
    }

    pub fn shift(&mut self, offset: f64) {
        self.clock.offset += offset;
        self.events.iter_mut().flatten().for_each(|event| event.time += offset);
    }

    /// The names of the columns that are read, that of the times first.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    pub fn is_own(&self) -> bool {
        self.differences.is_some()
    }

    pub fn differences(&self) -> &[CaseDifference] {
        self.differences.as_deref().unwrap_or_default()
    }

    pub(crate) fn has_rows(&self) -> bool {
        self.table.is_some()
    }

    /// Channels that it has or that follow from its columns, in the reference's order.
    pub fn channels(&self, physics: &Physics) -> Vec<Channel> {
        let all = physics.vocabulary().channels();
        all.filter(|&channel| self.has(channel)).collect()
    }

    /// [`Self::channels`] without impulses.
    pub fn compared_channels(&self, physics: &Physics) -> Vec<Channel> {
        let mut channels = self.channels(physics);
        channels.retain(|channel| !channel.is_impulse());
        channels
    }

    pub fn has(&self, channel: Channel) -> bool {
        self.supply(channel).is_some()
    }

    /// Whether a channel follows from its columns alone, without the reference's motion of a driven end.
    pub fn is_its_own(&self, channel: Channel) -> bool {
        self.has(channel) && self.drive_of(channel).is_empty()
    }

    fn supply(&self, channel: Channel) -> Option<&Supply> {
        self.supplies.iter().find(|supply| supply.channel == channel)
    }

    /// The name of a channel, and of its column if the file has another name for it: "phi1 (x)".
    pub fn name_of(&self, channel: Channel) -> String {
        let direct = self.supply(channel).filter(|supply| !supply.is_computed());
        let column = direct.map(|supply| &self.columns[supply.terms()[0].0]);
        let name = channel.name().into_owned();
        match column.filter(|column| **column != name) {
            Some(column) => format!("{name} ({column})"),
            None => name,
        }
    }

    /// Channels and factors of which a channel is the sum, beside the motion of driven ends; empty if it is a column of
    /// the file.
    pub fn sum_of(&self, channel: Channel) -> Vec<(Channel, f64)> {
        let term = |&(column, factor): &(usize, f64)| {
            let is_column = |supply: &&Supply| !supply.is_computed() && supply.terms()[0].0 == column;
            let direct = self.supplies.iter().find(is_column)?;
            (direct.channel != channel).then_some((direct.channel, factor / direct.terms()[0].1))
        };
        let terms = self.supply(channel).map_or(&[][..], Supply::terms);
        terms.iter().map(term).collect::<Option<_>>().unwrap_or_default()
    }

    /// The motion of driven ends in a channel, which the reference supplies.
    pub fn drive_of(&self, channel: Channel) -> &[(Known, f64)] {
        self.supply(channel).map_or(&[], Supply::drive)
    }

    /// Error bound of a channel at this value due to rounding in the file; 0 for a missing channel.
    pub fn rounding_of(&self, channel: Channel, value: f64) -> f64 {
        self.supply(channel)
            .map_or(0.0, |supply| supply.rounding(value, &self.digital))
    }

    /// Error of a channel due to rounded times (s, up to `to`), at which the reference supplies the motion of its driven
    /// ends.
    pub fn clock_error_of(&self, channel: Channel, physics: &Physics, (from, to): (f64, f64)) -> f64 {
        let rounding = self.clock.rounding.filter(|_| self.clock_rounds);
        let supply = self.supply(channel).filter(|supply| !supply.drive().is_empty());
        let Some((rounding, supply)) = rounding.zip(supply) else {
            return 0.0;
        };
        let quantum = self.clock.quantum(rounding, to);
        0.5 * supply.change_of_drive(physics, (from, to), quantum)
    }

    /// The coarsest rounding, relative to the values, of the columns behind `channels`; `None` for doubles.
    pub fn coarsest(&self, channels: &[Channel]) -> Option<Rounding> {
        let known = self.supplies.iter().filter(|supply| channels.contains(&supply.channel));
        let columns = known.flat_map(Supply::columns);
        let columns = columns.filter_map(|column| self.digital.get(column));
        let part = |digital: &&Digital| digital.error(digital.largest) / digital.largest;
        let rounded = columns.filter(|digital| digital.rounding.is_some());
        rounded.max_by(|a, b| part(a).total_cmp(&part(b)))?.rounding
    }

    pub fn rows<'a>(&'a self, channels: &[Channel], physics: &'a Physics) -> Result<Rows<'a>, CompareError> {
        let remedy = "give a time series to compare states";
        let none = || CompareError::whole(&self.path, "has events but no samples", remedy);
        let table = self.table.as_ref().ok_or_else(none)?;
        let supplies = channels.iter().filter_map(|&channel| self.supply(channel).cloned());
        Rows::new(table, &self.columns, &self.clock, supplies.collect(), physics)
    }
}

type OfFormat = (&'static str, CandidateTable);

fn table_of(source: CandidateSource, head: &[u8]) -> Result<OfFormat, CompareError> {
    if let Some(known) = hdf5_or_npz(&source, head)? {
        return Ok(known);
    }
    let path = source.path();
    if let Some((what, how)) = to_convert(path, head) {
        let what = format!("is {what}, which this version does not read");
        return Err(CompareError::whole(path, what, format!("convert it to CSV: {how}")));
    }
    let is_named_hdf5 = ["h5", "hdf5", "nc"]
        .iter()
        .any(|known| path.extension().is_some_and(|end| end == *known));
    if is_named_hdf5 || head[..head.len().min(8)].contains(&0) {
        let what = "does not begin as an HDF5, NPZ or CSV file does";
        let remedy = "it was cut off or is of another format: give HDF5, NPZ or CSV";
        return Err(CompareError::whole(path, what, remedy));
    }
    Ok(("CSV", CsvReader::open(source)?))
}

fn hdf5_or_npz(source: &CandidateSource, head: &[u8]) -> Result<Option<OfFormat>, CompareError> {
    if head.starts_with(b"\x89HDF") {
        refuse_pipe(source)?;
        check_sound(source.path())?;
        let file = ForeignFile::open(source.path())?;
        return Ok(Some(("HDF5", foreign_table(file))));
    }
    if head.starts_with(b"PK") {
        return Ok(Some(("NPZ", npz_table(source)?)));
    }
    Ok(None)
}

/// A history of a finite-element code: its format, and the command that converts it to CSV.
fn to_convert(path: &Path, head: &[u8]) -> Option<(&'static str, &'static str)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    // A Fortran record of 84 bytes: version and title of the run.
    if head.starts_with(b"\0\0\0\x54\0") {
        return Some(("a time history of OpenRadioss", "th_to_csv FILE"));
    }
    // The widths of the numbers in an LSDA file.
    if head.starts_with(&[8, 8, 8, 1, 1]) || name.starts_with("binout") && head.contains(&0) {
        let how = "python3 -c 'from lasso.dyna import Binout; \
                   Binout(\"binout*\").as_df(\"nodout\", \"rz_velocity\").to_csv(\"binout.csv\")'";
        return Some(("a binout of LS-DYNA", how));
    }
    let is_header = |line: &str| line.split_whitespace().next() == Some("X");
    let text = String::from_utf8_lossy(head);
    if name.ends_with(".rpt") && text.lines().find(|line| !line.trim().is_empty()).is_some_and(is_header) {
        let how = "awk -v OFS=, 'BEGIN { print \"time,phi2_dot,phi1_dot\" } \
                   /^ *[-+]?[0-9]/ && !/NoValue/ { $1 = $1; print }' FILE > FILE.csv, with the names of its columns";
        return Some(("an XY report of Abaqus", how));
    }
    None
}

fn refuse_pipe(source: &CandidateSource) -> Result<(), CompareError> {
    if source.is_piped() {
        let remedy = "save it in a file, and name that";
        return Err(CompareError::whole(source.path(), "HDF5 came through a pipe", remedy));
    }
    Ok(())
}
