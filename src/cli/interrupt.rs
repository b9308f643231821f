//! Interruption of commands.

use super::INTERRUPTED;
use crate::Error;
use signal_hook::consts;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A flag that Ctrl-C and the termination signals set; the run then ends cleanly. A second Ctrl-C or SIGTERM ends the
/// process at once. A second SIGHUP does not, because terminals send it twice.
pub(super) fn interrupt_flag() -> Result<Arc<AtomicBool>, Error> {
    let flag = Arc::new(AtomicBool::new(false));
    let failed = |error| Error::computation(format!("the signal handler could not be set: {error}"));
    // Registered before the handler that sets the flag, because handlers run in the order of registration.
    for signal in [consts::SIGINT, consts::SIGTERM] {
        signal_hook::flag::register_conditional_shutdown(signal, INTERRUPTED.into(), flag.clone()).map_err(failed)?;
    }
    let signals = [
        consts::SIGINT,
        consts::SIGTERM,
        #[cfg(unix)]
        consts::SIGHUP,
        #[cfg(windows)]
        consts::SIGBREAK,
    ];
    for signal in signals {
        signal_hook::flag::register(signal, flag.clone()).map_err(failed)?;
    }
    Ok(flag)
}
