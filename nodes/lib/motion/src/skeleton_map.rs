//! Which joint of a source is which joint of SMPL: data, one YAML file a skeleton.

use cromosim_spatial::{in_plain_words, meant};
use std::collections::BTreeMap;

use cromosim_body::{JOINT_COUNT, Joint};
use nalgebra::{UnitQuaternion, Vector3};
use serde::Deserialize;

use crate::axes::frame_of;
use crate::{BvhClip, MotionError};

const EMBEDDED: [(&str, &str); 8] = [
    ("cmu", include_str!("../maps/cmu.yaml")),
    ("cmu_asf", include_str!("../maps/cmu_asf.yaml")),
    ("daz", include_str!("../maps/daz.yaml")),
    ("lafan1", include_str!("../maps/lafan1.yaml")),
    ("mixamo", include_str!("../maps/mixamo.yaml")),
    ("mvn", include_str!("../maps/mvn.yaml")),
    ("smpl", include_str!("../maps/smpl.yaml")),
    ("xsens", include_str!("../maps/xsens.yaml")),
];

/// Joints without which a motion cannot be retargeted, beside the neck or the head.
pub(crate) const INDISPENSABLE: [Joint; 14] = [
    Joint::Pelvis,
    Joint::LeftHip,
    Joint::RightHip,
    Joint::LeftKnee,
    Joint::RightKnee,
    Joint::LeftAnkle,
    Joint::RightAnkle,
    Joint::Spine3,
    Joint::LeftShoulder,
    Joint::RightShoulder,
    Joint::LeftElbow,
    Joint::RightElbow,
    Joint::LeftWrist,
    Joint::RightWrist,
];

/// How the feet stand in the source's rest pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FeetAtRest {
    /// The soles are level.
    #[default]
    Flat,
    /// The ankles are straight: splayed shins carry the feet with them.
    WithShins,
}

/// One value for each side of the body.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sides<V> {
    /// The subject's left.
    pub left: V,
    /// The subject's right.
    pub right: V,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawMap {
    name: String,
    description: String,
    joints: BTreeMap<String, String>,
    hand_point: Option<Sides<String>>,
    thumb_side: Option<Sides<[String; 2]>>,
    #[serde(default)]
    feet: FeetAtRest,
    unit_scale_m: Option<f64>,
    #[serde(default)]
    rest_axes: BTreeMap<String, RawAxes>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawAxes {
    x: [f64; 3],
    y: [f64; 3],
}

/// A skeleton's names. Names are compared without case, spaces, underscores and anything before a
/// colon.
///
/// As YAML: `name`, `description`, `joints` (SMPL's name: the source's name), and where known
/// `hand_point` (a joint in the middle of the knuckles), `thumb_side` (two points, from the little
/// finger's side to the thumb's; `NAME/tip` is the end site of a joint), `feet` (`flat` or
/// `with_shins`), `unit_scale_m` (metres per unit) and `rest_axes` (x and y axis of a joint's frame
/// in a T-pose, in body axes [left, up, forward], for skeletons whose zero pose is no human pose).
#[derive(Clone, Debug, PartialEq)]
pub struct SkeletonMap {
    pub(crate) name: String,
    description: String,
    joints: [Option<String>; JOINT_COUNT],
    hand_point: Option<Sides<String>>,
    thumb_side: Option<Sides<[String; 2]>>,
    feet: FeetAtRest,
    unit_scale_m: Option<f64>,
    rest_axes: Vec<(String, UnitQuaternion<f64>)>,
}

/// A point of a source's skeleton.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Point {
    Joint(usize),
    Tip(usize),
}

/// A map whose names were looked up in one clip.
#[derive(Clone, Debug)]
pub(crate) struct BoundMap {
    pub name: String,
    pub joints: [Option<usize>; JOINT_COUNT],
    /// Where the hands and feet point, by SMPL's wrist or ankle: a point beyond that joint.
    pub hands: Sides<Option<Point>>,
    pub toes: Sides<Option<Point>>,
    pub thumb_sides: Sides<Option<[Point; 2]>>,
    pub feet: FeetAtRest,
    pub unit_scale_m: Option<f64>,
    /// body_from_joint in a T-pose, where the map says it for all mapped joints.
    pub rest_axes: Option<Vec<Option<UnitQuaternion<f64>>>>,
}

impl SkeletonMap {
    /// The maps that come with the suite: cmu, cmu_asf, daz, lafan1, mixamo, mvn, smpl,
    /// xsens.
    ///
    /// # Errors
    /// None in practice: a test reads them all.
    pub fn embedded() -> Result<Vec<Self>, MotionError> {
        EMBEDDED
            .iter()
            .map(|(name, yaml)| Self::from_yaml(yaml, &format!("embedded map {name}")))
            .collect()
    }

    /// From YAML; `origin` names the file in errors.
    ///
    /// # Errors
    /// [`MotionError::MapSyntax`] and [`MotionError::MapContent`].
    pub fn from_yaml(yaml: &str, origin: &str) -> Result<Self, MotionError> {
        let raw: RawMap = serde_norway::from_str(yaml).map_err(|error| MotionError::MapSyntax {
            origin: origin.to_owned(),
            problem: in_plain_words(error),
        })?;
        let content = |key: String, problem: &str| MotionError::MapContent {
            origin: origin.to_owned(),
            key,
            problem: problem.to_owned(),
        };
        let unit = raw.unit_scale_m;
        let joints = smpl_joints(raw.joints).map_err(|(key, problem)| content(key, &problem))?;
        if unit.is_some_and(|scale| !(scale > 0.0 && scale.is_finite())) {
            let problem = "expected metres per unit, more than 0";
            return Err(content("unit_scale_m".to_owned(), problem));
        }
        let mut rest_axes = Vec::new();
        for (joint, RawAxes { x, y }) in raw.rest_axes {
            let (x, y) = (Vector3::from(x), Vector3::from(y));
            let orthonormal = (x.norm() - 1.0).abs() < 1e-3
                && (y.norm() - 1.0).abs() < 1e-3
                && x.dot(&y).abs() < 1e-3;
            if !orthonormal {
                let problem = "x and y are not of length 1 and perpendicular";
                return Err(content(format!("rest_axes.{joint}"), problem));
            }
            rest_axes.push((joint, frame_of(x, y)));
        }
        Ok(Self {
            name: raw.name,
            description: raw.description,
            joints,
            hand_point: raw.hand_point,
            thumb_side: raw.thumb_side,
            feet: raw.feet,
            unit_scale_m: unit,
            rest_axes,
        })
    }

    /// The map's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the map is for, in a few words.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// Joints of the map that `clip` does not have.
    pub fn missing_in(&self, clip: &BvhClip) -> Vec<String> {
        let names = Names::in_clip(clip);
        self.joints
            .iter()
            .flatten()
            .filter(|name| names.joint(name).is_none())
            .cloned()
            .collect()
    }

    /// The map with the clip's joint indices; an error where an indispensable joint is not there.
    pub(crate) fn bind(&self, clip: &BvhClip) -> Result<BoundMap, MotionError> {
        let names = Names::in_clip(clip);
        let joints: [Option<usize>; JOINT_COUNT] = std::array::from_fn(|index| {
            self.joints[index]
                .as_deref()
                .and_then(|name| names.joint(name))
        });
        let missing = self.missing_indispensable(&joints);
        if !missing.is_empty() {
            return Err(MotionError::MissingJoints {
                name: clip.name().to_owned(),
                map: self.name.clone(),
                missing,
            });
        }
        let side = |wrist: Joint, given: Option<&String>| {
            given
                .and_then(|name| names.point(name))
                .or_else(|| beyond(clip, joints[wrist.index()]?))
        };
        let hand = self.hand_point.as_ref();
        let toe = |foot: Joint, ankle: Joint| {
            joints[foot.index()]
                .map(Point::Joint)
                .or_else(|| side(ankle, None))
        };
        let thumb = |points: Option<&[String; 2]>| {
            points.and_then(|[from, to]| Some([names.point(from)?, names.point(to)?]))
        };
        let axes: Vec<_> = clip
            .joints()
            .iter()
            .map(|joint| {
                self.rest_axes
                    .iter()
                    .find(|(name, _)| same(name, &joint.name))
                    .map(|(_, q)| *q)
            })
            .collect();
        let all_have_axes = joints.iter().flatten().all(|&joint| axes[joint].is_some());
        Ok(BoundMap {
            name: self.name.clone(),
            joints,
            hands: Sides {
                left: side(Joint::LeftWrist, hand.map(|sides| &sides.left)),
                right: side(Joint::RightWrist, hand.map(|sides| &sides.right)),
            },
            toes: Sides {
                left: toe(Joint::LeftFoot, Joint::LeftAnkle),
                right: toe(Joint::RightFoot, Joint::RightAnkle),
            },
            thumb_sides: Sides {
                left: thumb(self.thumb_side.as_ref().map(|sides| &sides.left)),
                right: thumb(self.thumb_side.as_ref().map(|sides| &sides.right)),
            },
            feet: self.feet,
            unit_scale_m: self.unit_scale_m,
            rest_axes: all_have_axes.then_some(axes),
        })
    }

    /// Indispensable names that were not found.
    fn missing_indispensable(&self, found: &[Option<usize>; JOINT_COUNT]) -> Vec<String> {
        let name = |joint: Joint| self.joints[joint.index()].clone();
        let mut missing: Vec<String> = INDISPENSABLE
            .into_iter()
            .filter(|joint| found[joint.index()].is_none())
            .filter_map(name)
            .collect();
        if found[Joint::Neck.index()].is_none() && found[Joint::Head.index()].is_none() {
            missing.extend(name(Joint::Neck).or_else(|| name(Joint::Head)));
        }
        missing
    }

    /// The embedded map that fits `clip` best: all its indispensable joints are there, and it
    /// leaves out the fewest.
    pub(crate) fn detect(clip: &BvhClip) -> Result<BoundMap, MotionError> {
        let maps = Self::embedded()?;
        let names = Names::in_clip(clip);
        let found = |map: &Self| {
            map.joints
                .iter()
                .flatten()
                .filter(|name| names.joint(name).is_some())
                .count()
        };
        let total = |map: &Self| map.joints.iter().flatten().count();
        let fits = |map: &&Self| map.bind(clip).is_ok();
        if let Some(best) = maps
            .iter()
            .filter(fits)
            .min_by_key(|map| (total(map) - found(map), usize::MAX - found(map)))
        {
            return best.bind(clip);
        }
        match maps.iter().max_by_key(|map| found(map) * 100 / total(map)) {
            Some(nearest) => Err(MotionError::UnknownSkeleton {
                name: clip.name().to_owned(),
                nearest: nearest.name.clone(),
                found: found(nearest),
                total: total(nearest),
                missing: nearest.missing_in(clip),
            }),
            None => Err(MotionError::UnknownMap {
                given: String::new(),
                known: Vec::new(),
            }),
        }
    }
}

/// The source's names by SMPL's joints; the key and what is wrong with it where a name is unknown or
/// missing.
fn smpl_joints(
    names: BTreeMap<String, String>,
) -> Result<[Option<String>; JOINT_COUNT], (String, String)> {
    let mut joints: [Option<String>; JOINT_COUNT] = Default::default();
    for (smpl, source) in names {
        let joint = Joint::from_name(&smpl).ok_or_else(|| {
            let meant = meant(&smpl, Joint::ALL.iter().map(|joint| joint.name()));
            let problem = format!("SMPL has no such joint{meant}");
            (format!("joints.{smpl}"), problem)
        })?;
        joints[joint.index()] = Some(source);
    }
    let missing = INDISPENSABLE
        .iter()
        .find(|joint| joints[joint.index()].is_none());
    if let Some(joint) = missing {
        return Err((
            format!("joints.{joint}"),
            "missing, and indispensable".to_owned(),
        ));
    }
    if joints[Joint::Neck.index()].is_none() && joints[Joint::Head.index()].is_none() {
        let problem = "missing, and so is head; one of them is needed";
        return Err(("joints.neck".to_owned(), problem.to_owned()));
    }
    Ok(joints)
}

/// The tip beyond a joint, or else its farthest child: of a hand's children a finger, not the
/// thumb.
fn beyond(clip: &BvhClip, joint: usize) -> Option<Point> {
    if clip.joints()[joint].tip.is_some_and(|tip| tip.norm() > 0.0) {
        return Some(Point::Tip(joint));
    }
    let children = clip
        .joints()
        .iter()
        .enumerate()
        .filter(|(_, child)| child.parent == Some(joint) && child.rest_in_parent.norm() > 0.0);
    let farthest = children.max_by(|(_, left), (_, right)| {
        left.rest_in_parent
            .norm()
            .total_cmp(&right.rest_in_parent.norm())
    });
    farthest.map(|(index, _)| Point::Joint(index))
}

/// A clip's joint names, made comparable.
struct Names(Vec<String>);

impl Names {
    fn in_clip(clip: &BvhClip) -> Self {
        Self(
            clip.joints()
                .iter()
                .map(|joint| comparable(&joint.name))
                .collect(),
        )
    }

    fn joint(&self, name: &str) -> Option<usize> {
        let name = comparable(name);
        self.0.iter().position(|known| *known == name)
    }

    fn point(&self, name: &str) -> Option<Point> {
        match name.strip_suffix("/tip") {
            Some(joint) => self.joint(joint).map(Point::Tip),
            None => self.joint(name).map(Point::Joint),
        }
    }
}

fn same(left: &str, right: &str) -> bool {
    comparable(left) == comparable(right)
}

fn comparable(name: &str) -> String {
    let bare = name.rsplit(':').next().unwrap_or(name);
    bare.chars()
        .filter(|character| !character.is_whitespace() && *character != '_')
        .flat_map(char::to_lowercase)
        .collect()
}
