//! `stickslip certify` for the file of a cycle.

use super::arguments::{CertifyOptions, Common};
use super::input::{interrupt_flag, output_of, overwrite};
use super::{CommandEnd, CommandError, interrupted, tell};
use crate::report::CycleCertificateReport;
use std::path::Path;
use std::sync::atomic::Ordering;
use stickslip_analysis::cycle::{certify as by_oracle, from_file};
use stickslip_case::{Case, CaseSource};
use stickslip_files::{ResultFile, check_target, schema::group, write_certified};
use stickslip_oracle as oracle;

const DIGITS: u32 = 25;

pub(super) fn is_one(path: &Path) -> bool {
    let file = ResultFile::open(path);
    file.is_ok_and(|file| matches!(file.added_group(group::CYCLE, 0), Ok(Some(_))))
}

pub(super) fn certify(path: &Path, options: &CertifyOptions, common: &Common) -> Result<CommandEnd, CommandError> {
    if !options.set.is_empty() {
        return Err(CommandError::input(
            "--set changes a case, not the file of a cycle: find the cycle of the changed case with stickslip cycle \
             --set, and certify that",
        ));
    }
    if options.figure.is_some() {
        return Err(CommandError::input(
            "--figure draws the first stick of sliding that slows down by itself, and a cycle has none; leave it out",
        ));
    }
    if options.budget.is_given() {
        return Err(CommandError::input(
            "--max-wall-time bounds runs, and the exact solver makes the certificate of a cycle; leave it out, or end the command by Ctrl-C",
        ));
    }
    let digits = options.digits.unwrap_or(DIGITS);
    let most = oracle::DIGITS.end() - 20;
    if !(1..=most).contains(&digits) {
        return Err(CommandError::input(format!(
            "--digits {digits}: from 1 to {most} digits can be asked for"
        )));
    }
    let files = [path.to_owned()];
    let source = CaseSource::result(path, String::new());
    let target = output_of(&source, options.output.as_deref(), ".certified.h5")?;
    check_target(&target, overwrite(options.force), &files)?;
    let stop = interrupt_flag()?;
    let stopped = || stop.load(Ordering::Relaxed);
    let file = ResultFile::open(path)?;
    let found = from_file(&file, &stopped);
    drop(file);
    let (family, orbit, origin) = match found {
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " before the cycle was found; no certificate was written");
        }
        found => found?,
    };
    let exact = Case::exact(&origin.source, &origin.changes)?;
    let certificate = match by_oracle(&family, &orbit, &exact, digits, origin.periods_before, &*stop) {
        Err(error) if error.is_interrupted() => {
            return interrupted(common, " while the exact solver computed; no certificate was written");
        }
        other => other.map_err(CommandError::computation)?,
    };
    write_certified(path, &target, overwrite(options.force), &certificate.additions())?;
    let report = CycleCertificateReport {
        status: "complete",
        file: target.display().to_string(),
        title: &family.case().title,
        certificate: &certificate,
    };
    tell(common, &report)?;
    Ok(CommandEnd::Done)
}
