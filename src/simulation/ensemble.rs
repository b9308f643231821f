//! Runs side by side on one thread, whose Taylor series are computed together.
//!
//! A run that needs an expansion leaves it on its [`Seat`] and says so ([`Advance::Waiting`](crate::hybrid::Advance::Waiting)); its
//! control is asked next, and lets the other runs go on. When all of them wait, their expansions are filled at once (`expansion/lanes.rs`),
//! and each goes on by itself. Each run is a coroutine, so that none has to be written as what can be left and entered again. A run
//! takes the same steps, and comes to the same numbers to the last bit, whoever sits beside it.

use super::expansion::{Motion, SideBySide};
use corosensei::stack::DefaultStack;
use corosensei::{ScopedCoroutine, Yielder};
use std::any::Any;
use std::array;
use std::cell::Cell;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Most runs side by side: as many doubles as fit into a vector of AVX2.
const LANES: usize = 4;

/// Bytes of the stack of each run but the first; what is not used takes no memory.
const STACK: usize = 8 << 20;

/// The place of a run in an ensemble.
#[derive(Default)]
pub struct Seat {
    motion: Mutex<Option<Motion>>,
}

impl fmt::Debug for Seat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Seat").finish_non_exhaustive()
    }
}

impl Seat {
    fn motion(&self) -> MutexGuard<'_, Option<Motion>> {
        self.motion.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Leaves a motion whose expansion is to be filled.
    pub(super) fn ask(&self, motion: Motion) {
        *self.motion() = Some(motion);
    }

    /// Takes it back.
    pub(super) fn take(&self) -> Option<Motion> {
        self.motion().take()
    }
}

/// What a run in an ensemble has of it.
#[derive(Clone, Copy)]
pub(crate) struct Beside<'a> {
    /// Its place.
    pub seat: &'a Arc<Seat>,
    yielder: &'a Yielder<(), ()>,
}

impl Beside<'_> {
    /// To be called by the control of the run: lets the others go on, if this one waits.
    pub fn wait(&self) {
        if self.seat.motion().is_some() {
            self.yielder.suspend(());
        }
    }

    /// To be called after a run: what it has left when it was ended is not for the next.
    pub fn leave(&self) {
        self.seat.take();
    }
}

/// Does `work` on so many seats, at least one and at most [`LANES`]: on each until it waits, then on the next. Work alone has no seat. So
/// has all of it where the system has no memory for the stacks.
///
/// # Panics
/// Goes on with the first panic of the work, when the rest of it is done.
pub(crate) fn side_by_side(seats: usize, work: &dyn Fn(Option<Beside<'_>>)) {
    let stacks: Result<Vec<_>, _> = (0..seats.min(LANES)).map(|_| DefaultStack::new(STACK)).collect();
    let stacks = match stacks {
        Ok(stacks) if stacks.len() > 1 => stacks,
        _ => return work(None),
    };
    let seats: [_; LANES] = array::from_fn(|_| Arc::new(Seat::default()));
    let panic: Cell<Option<Box<dyn Any + Send>>> = Cell::new(None);
    // No panic may leave a coroutine while others are suspended: they would be unwound where they stand.
    let work = |beside: Beside<'_>| {
        if let Err(payload) = catch_unwind(AssertUnwindSafe(|| work(Some(beside)))) {
            panic.set(Some(panic.take().unwrap_or(payload)));
        }
    };
    occupy(&seats, stacks, Vec::new(), &work);
    if let Some(payload) = panic.into_inner() {
        resume_unwind(payload);
    }
}

/// Goes on with the work on one seat, and says whether there is more.
type GoOn<'a> = dyn FnMut() -> bool + 'a;

/// Lets work take the seats beside the occupied ones, one for each stack, and does all of it.
fn occupy<'a>(
    seats: &'a [Arc<Seat>; LANES],
    mut stacks: Vec<DefaultStack>,
    occupied: Vec<&'a mut GoOn<'a>>,
    work: &dyn Fn(Beside<'_>),
) {
    let Some(stack) = stacks.pop() else {
        return in_turn(seats, occupied);
    };
    let seat = &seats[occupied.len()];
    let body = |yielder: &Yielder<(), ()>, ()| work(Beside { seat, yielder });
    ScopedCoroutine::with_stack(stack, body).scope(|mut coroutine| {
        let mut go_on = || coroutine.as_mut().resume(()).as_yield().is_some();
        let mut all: Vec<&mut GoOn<'_>> = Vec::new();
        for before in occupied {
            all.push(before);
        }
        all.push(&mut go_on);
        occupy(seats, stacks, all, work);
    });
}

/// Until no work is left.
fn in_turn(seats: &[Arc<Seat>; LANES], work: Vec<&mut GoOn<'_>>) {
    let mut expansions = SideBySide::<LANES>::default();
    let mut left: Vec<_> = work.into_iter().map(Some).collect();
    while left.iter().any(Option::is_some) {
        for one in &mut left {
            if let Some(go_on) = one
                && !go_on()
            {
                *one = None;
            }
        }
        let mut asked = seats.each_ref().map(|seat| seat.motion());
        expansions.expand(asked.each_mut().map(|motion| motion.as_mut()));
    }
}
