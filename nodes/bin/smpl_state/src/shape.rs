//! The shape of a body does not change while it moves: betas are averaged over time. Where they
//! belong to another body, this node's body is fitted to that person's bones.

use std::sync::Arc;

use cromosim_body::{BodyError, BodyModel, JOINT_COUNT, Joint, ShapeSpace, ShapedBody};
use cromosim_msgs::cromosim_msgs::SmplPose;
use nalgebra::Vector3;

/// A step of a beta that is worth a new shape, standard deviations. 0.01 moves no surface point by
/// more than about a millimetre.
const WORTHWHILE: f64 = 0.01;

/// The mean of all betas so far, and the betas in force.
#[derive(Default)]
pub struct ShapeAverage {
    mean: Vec<f64>,
    count: f64,
    in_force: Vec<f64>,
}

impl ShapeAverage {
    /// Takes in one estimate of finite numbers; true if the betas in force have changed. An empty
    /// estimate changes nothing.
    pub fn add(&mut self, betas: &[f64]) -> bool {
        if betas.is_empty() {
            return false;
        }
        if betas.len() != self.mean.len() {
            *self = Self {
                mean: vec![0.0; betas.len()],
                count: 0.0,
                in_force: vec![f64::NAN; betas.len()],
            };
        }
        self.count += 1.0;
        for (mean, beta) in self.mean.iter_mut().zip(betas) {
            *mean += (beta - *mean) / self.count;
        }
        let near = self
            .mean
            .iter()
            .zip(&self.in_force)
            .all(|(mean, held)| (mean - held).abs() < WORTHWHILE);
        if !near {
            self.in_force.clone_from(&self.mean);
        }
        !near
    }

    /// The betas in force; empty before the first estimate.
    pub fn betas(&self) -> &[f64] {
        &self.in_force
    }
}

/// The shape of the node's body, whoever's betas come in.
pub struct PersonShape {
    model: Arc<BodyModel>,
    source_body: Option<Arc<BodyModel>>,
    average: ShapeAverage,
    /// Whether the average is of the source body's betas.
    of_source: bool,
    shaped: ShapedBody,
    /// Leg length of the node's body by that of the person on the source body; 1 without one.
    leg_ratio: f64,
}

impl PersonShape {
    /// The mean body.
    pub fn new(
        model: Arc<BodyModel>,
        source_body: Option<Arc<BodyModel>>,
    ) -> Result<Self, BodyError> {
        let shaped = ShapedBody::new(model.clone(), &[])?;
        Ok(Self {
            model,
            source_body,
            average: ShapeAverage::default(),
            of_source: false,
            shaped,
            leg_ratio: 1.0,
        })
    }

    /// Takes in what a pose says about the shape. Betas of the node's own body are averaged; others
    /// are averaged as those of the source body, and the node's is fitted to that person's bones.
    ///
    /// # Errors
    /// Betas that fit neither body, are too many or are not finite; the shape is unchanged then.
    pub fn take(&mut self, source: &SmplPose) -> Result<(), BodyError> {
        let betas = &source.betas;
        let own = self
            .model
            .check_named_betas(&source.shape_space, &source.gender, betas);
        let space = ShapeSpace::from_name(&source.shape_space);
        let others = space.is_some_and(|space| own.is_err() || space != self.model.shape_space());
        let source_body = self.source_body.clone().filter(|_| others);
        match &source_body {
            Some(body) => body.check_named_betas(&source.shape_space, &source.gender, betas)?,
            None => own?,
        }
        let body = source_body.as_ref().unwrap_or(&self.model);
        if betas.len() > body.beta_count() || !betas.iter().all(|beta| beta.is_finite()) {
            // Gives the error before the average takes the betas in for good.
            ShapedBody::new(body.clone(), betas)?;
        }
        if self.of_source != source_body.is_some() {
            self.average = ShapeAverage::default();
            self.of_source = source_body.is_some();
        }
        if !self.average.add(betas) {
            return Ok(());
        }
        (self.shaped, self.leg_ratio) = match source_body {
            None => (
                ShapedBody::new(self.model.clone(), self.average.betas())?,
                1.0,
            ),
            Some(body) => self.fitted(body)?,
        };
        Ok(())
    }

    /// The node's body fitted to the person's bones, and the ratio of the legs.
    fn fitted(&self, source_body: Arc<BodyModel>) -> Result<(ShapedBody, f64), BodyError> {
        let person = ShapedBody::new(source_body, self.average.betas())?;
        let fit = self
            .model
            .fit_bone_lengths(|joint| Some(person.joints_in_model()[joint.index()]), 1.0);
        let shaped = ShapedBody::new(self.model.clone(), &fit.betas)?;
        log::debug!(
            "betas of {}: fitted to their bones within {:.1} mm (RMS)",
            person.model().id(),
            1e3 * fit.length_rms_m
        );
        let leg_ratio = leg_length(shaped.joints_in_model()) / leg_length(person.joints_in_model());
        Ok((shaped, leg_ratio))
    }

    /// The body in its shape.
    pub fn shaped(&self) -> &ShapedBody {
        &self.shaped
    }

    /// The node's body's betas; empty before the first estimate.
    pub fn betas(&self) -> &[f64] {
        self.shaped.betas()
    }

    /// Factor on the source's positions, so that feet stay where they stand: 1 unless the body was
    /// fitted to another one.
    pub fn leg_ratio(&self) -> f64 {
        self.leg_ratio
    }
}

/// Mean length of thigh and shank together, m.
fn leg_length(joints: &[Vector3<f64>; JOINT_COUNT]) -> f64 {
    let length = |from: Joint, to: Joint| (joints[to.index()] - joints[from.index()]).norm();
    let left = length(Joint::LeftHip, Joint::LeftKnee) + length(Joint::LeftKnee, Joint::LeftAnkle);
    let right =
        length(Joint::RightHip, Joint::RightKnee) + length(Joint::RightKnee, Joint::RightAnkle);
    0.5 * (left + right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_settles_and_small_steps_change_nothing() {
        let mut average = ShapeAverage::default();
        assert!(!average.add(&[]));
        assert!(average.add(&[1.0, 0.0]));
        assert!(average.add(&[0.0, 0.0]));
        assert_eq!(average.betas(), [0.5, 0.0]);
        assert!(!average.add(&[0.501, 0.001]));
        assert_eq!(average.betas(), [0.5, 0.0]);
    }
}
