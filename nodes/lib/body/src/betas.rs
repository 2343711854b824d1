//! Whether shape coefficients suit a body.

use crate::gender::Gender;
use crate::{BodyError, BodyModel, ShapeSpace};

impl BodyModel {
    /// Whether betas of `space` and `gender` mean on this body what they were made for; no betas,
    /// or zeros, always do.
    ///
    /// SMPL's betas are coefficients of directions that its file holds: on another mesh the same
    /// numbers are another person. Where the people's bone lengths are known,
    /// [`Self::fit_bone_lengths`] finds this body's own betas instead.
    ///
    /// # Errors
    /// [`BodyError::ForeignBetas`] for those of another kind of body, or of another gender's file
    /// where both are known.
    pub fn check_betas(
        &self,
        space: ShapeSpace,
        gender: Option<Gender>,
        betas: &[f64],
    ) -> Result<(), BodyError> {
        let both = self.gender.zip(gender);
        let genders_differ =
            space != ShapeSpace::Cromosim && both.is_some_and(|(own, given)| own != given);
        if betas.iter().all(|&beta| beta == 0.0) || (space == self.space && !genders_differ) {
            return Ok(());
        }
        let named = |space: ShapeSpace, gender: Option<Gender>| match gender
            .filter(|_| genders_differ && space != ShapeSpace::Cromosim)
        {
            Some(gender) => format!("{space} {gender}"),
            None => space.to_string(),
        };
        let (body_of, betas_of) = (named(self.space, self.gender), named(space, gender));
        Err(BodyError::ForeignBetas {
            body: self.id.clone(),
            body_of,
            betas_of,
        })
    }
}

impl BodyModel {
    /// As [`Self::check_betas`], of the words that a message carries. Betas other than 0 need the
    /// word: nobody can tell from the numbers.
    ///
    /// # Errors
    /// [`BodyError::ForeignBetas`], and [`BodyError::UnknownShapeSpace`] for betas other than 0
    /// whose space is missing or unknown.
    pub fn check_named_betas(
        &self,
        shape_space: &str,
        gender: &str,
        betas: &[f64],
    ) -> Result<(), BodyError> {
        match ShapeSpace::from_name(shape_space) {
            Some(space) => self.check_betas(space, Gender::from_name(gender), betas),
            None if betas.iter().all(|&beta| beta == 0.0) => Ok(()),
            None => Err(BodyError::UnknownShapeSpace {
                given: shape_space.to_owned(),
            }),
        }
    }
}
