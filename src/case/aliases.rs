//! Earlier names of [`Case`], which go once their last user is gone.

use super::{Case, CaseError, CaseSource, Override, Words};

/// [`Case`].
pub type AnyCase = Case;
/// [`Case`].
pub type TrainCase = Case;
/// A [`Case`], lent.
pub type CaseRef<'a> = &'a Case;

impl From<&Case> for Case {
    fn from(case: &Case) -> Case {
        case.clone()
    }
}

impl Case {
    /// [`Case::read`].
    ///
    /// # Errors
    /// Those of [`Case::read`].
    pub fn parse(source: &CaseSource, overrides: &[Override]) -> Result<Case, CaseError> {
        Case::read(source, overrides)
    }

    /// [`Case::words`].
    pub fn form(&self) -> Words {
        self.words()
    }
}
