//! A first draft of a skeleton map, for a person to check: which joint is which follows from the
//! tree (two like branches are legs or arms) and, where they help, from the names.

use std::fmt::Write;

use cromosim_body::{JOINT_COUNT, Joint};
use cromosim_spatial::in_plain_words;
use nalgebra::Vector3;

use crate::skeleton_map::INDISPENSABLE;
use crate::{BvhClip, MotionError};

/// Joints of a limb, or of what else comes twice; less are eyes and the like.
const LEAST_LIMB: usize = 3;
/// How far bones of the left and the right side may differ in length.
const LIKE_LENGTHS: f64 = 0.05;
/// Characters of a word for a side.
const LONGEST_SIDE: usize = 6;

/// A drafted map.
#[derive(Clone, Debug, PartialEq)]
pub struct SkeletonDraft {
    /// The map's file, with the joints that were not found as comments.
    pub yaml: String,
    /// How many of SMPL's joints were found.
    pub found: usize,
    /// Joints that the map must have and that were not found.
    pub missing: Vec<Joint>,
}

impl SkeletonDraft {
    /// Drafts a map of the clip's joints; `name` becomes the map's.
    ///
    /// # Errors
    /// A name that cannot be written.
    pub fn of(clip: &BvhClip, name: &str) -> Result<Self, MotionError> {
        let joints = Tree::of(clip).assign();
        let mut missing: Vec<Joint> = INDISPENSABLE
            .into_iter()
            .filter(|joint| joints[joint.index()].is_none())
            .collect();
        if joints[Joint::Neck.index()].is_none() && joints[Joint::Head.index()].is_none() {
            missing.push(Joint::Neck);
        }
        Ok(Self {
            yaml: yaml(clip, name, &joints, &missing)?,
            found: joints.iter().flatten().count(),
            missing,
        })
    }
}

/// A text as YAML's scalar.
fn scalar(text: &str) -> Result<String, MotionError> {
    let yaml = serde_norway::to_string(text).map_err(|error| MotionError::MapSyntax {
        origin: text.to_owned(),
        problem: in_plain_words(error),
    })?;
    Ok(yaml.trim_end().to_owned())
}

fn yaml(
    clip: &BvhClip,
    name: &str,
    joints: &[Option<usize>; JOINT_COUNT],
    missing: &[Joint],
) -> Result<String, MotionError> {
    let mut text = format!(
        "# A draft: check each line, and left and right above all.\nname: {}\ndescription: {}\njoints:\n",
        scalar(name)?,
        scalar(&format!("drafted from {}", clip.name()))?
    );
    for joint in Joint::ALL {
        if let Some(index) = joints[joint.index()] {
            let name = scalar(&clip.joints()[index].name)?;
            text += &format!("  {joint}: {name}\n");
        } else if missing.contains(&joint) {
            text +=
                &format!("  # {joint}: not found; name the joint, without it nothing is read\n");
        }
    }
    text += "# Further keys: hand_point, thumb_side, feet, unit_scale_m, rest_axes (see the README of nodes/lib/motion).\n# The joints of the file:\n";
    let mut depths: Vec<usize> = Vec::new();
    for joint in clip.joints() {
        let depth = joint.parent.map_or(0, |parent| depths[parent] + 1);
        depths.push(depth);
        let shown = joint.name.replace(char::is_control, "?");
        // To a String nothing fails.
        let _ = writeln!(text, "#   {:1$}{shown}", "", 2 * depth.min(40));
    }
    Ok(text)
}

/// The file's joints as a tree.
struct Tree<'c> {
    clip: &'c BvhClip,
    children: Vec<Vec<usize>>,
    /// Joints below each, itself included.
    sizes: Vec<usize>,
    /// In the first frame.
    positions: Vec<Vector3<f64>>,
    /// Where the last bones end.
    tips: Vec<Option<Vector3<f64>>>,
}

impl<'c> Tree<'c> {
    fn of(clip: &'c BvhClip) -> Self {
        let joints = clip.joints();
        let (mut children, mut sizes) = (vec![Vec::new(); joints.len()], vec![1; joints.len()]);
        for (index, joint) in joints.iter().enumerate().rev() {
            if let Some(parent) = joint.parent {
                children[parent].insert(0, index);
                sizes[parent] += sizes[index];
            }
        }
        let pose = clip.pose_of_frame(0);
        let frames = pose.world_from_joint.iter();
        let positions = frames.map(|frame| frame.translation.vector);
        Self {
            clip,
            children,
            sizes,
            positions: positions.collect(),
            tips: pose.tips,
        }
    }

    fn name(&self, joint: usize) -> String {
        let name = &self.clip.joints()[joint].name;
        name.rsplit(':').next().unwrap_or(name).to_lowercase()
    }

    fn says(&self, joint: usize, words: &[&str]) -> bool {
        let name = self.name(joint);
        words.iter().any(|word| name.contains(word))
    }

    /// The child that carries most, with its own and so on; twists of bones are no joints.
    fn chain(&self, from: usize) -> Vec<usize> {
        let largest = |joint: &usize| {
            let children = self.children[*joint].iter().copied();
            children.rev().max_by_key(|child| self.sizes[*child])
        };
        std::iter::successors(Some(from), largest)
            .filter(|joint| !self.says(*joint, &["twist", "roll"]))
            .collect()
    }

    /// Two children that are alike: a limb of each side, in no order yet.
    fn limbs(&self, joint: usize) -> Option<[usize; 2]> {
        let children = &self.children[joint];
        let large = |child: &&usize| self.sizes[**child] >= LEAST_LIMB;
        let mut large: Vec<usize> = children.iter().filter(large).copied().collect();
        large.sort_by_key(|child| std::cmp::Reverse(self.sizes[*child]));
        let pairs = large.iter().enumerate().flat_map(|(at, &first)| {
            let behind = large[at + 1..].iter();
            behind.map(move |&second| [first, second])
        });
        let pairs: Vec<[usize; 2]> = pairs.collect();
        let named = pairs.iter().find(|pair| self.named_left(**pair).is_some());
        let alike = || pairs.iter().find(|pair| self.alike(**pair));
        named.or_else(alike).copied()
    }

    fn alike(&self, [a, b]: [usize; 2]) -> bool {
        let (a, b) = (self.chain(a), self.chain(b));
        let length = |joint: &usize| self.clip.joints()[*joint].rest_in_parent.norm();
        a.len() == b.len()
            && a.iter().zip(&b).all(|(a, b)| {
                let (a, b) = (length(a), length(b));
                (a - b).abs() <= LIKE_LENGTHS * a.max(b)
            })
    }

    /// The left one of two whose names differ in the side alone: `LeftArm` and `RightArm`, `arm_l`
    /// and `arm_r`.
    fn named_left(&self, [a, b]: [usize; 2]) -> Option<usize> {
        let [first, second] = [a, b].map(|joint| self.name(joint).chars().collect::<Vec<char>>());
        let same = |(a, b): &(&char, &char)| a == b;
        let front = first.iter().zip(&second).take_while(same).count();
        let (first, second) = (&first[front..], &second[front..]);
        let ends = first.iter().rev().zip(second.iter().rev());
        let back = ends.take_while(same).count();
        // `lef` and `righ`, or `l` and `r`: else the names have nothing in common.
        if first.len().max(second.len()) > back + LONGEST_SIDE {
            return None;
        }
        match (first.first()?, second.first()?) {
            ('l', 'r') => Some(a),
            ('r', 'l') => Some(b),
            _ => None,
        }
    }

    /// Left and right of two limbs: by their names, else by where they are in the first frame.
    fn sides(&self, [a, b]: [usize; 2], left: Option<Vector3<f64>>) -> [usize; 2] {
        let placed = || {
            // Not the first joint alone, which may stand in the middle.
            let place = |from: usize| -> Vector3<f64> {
                let joints = self.chain(from).into_iter().take(2);
                joints.map(|joint| self.positions[joint]).sum()
            };
            let across = place(a) - place(b);
            left.filter(|left| across.dot(left) < 0.0).map(|_| b)
        };
        match self.named_left([a, b]).or_else(placed) {
            Some(left) if left == b => [b, a],
            _ => [a, b],
        }
    }

    /// The subject's left in the first frame: up from the feet to the head, forward along the toes.
    fn left(&self, legs: [[Option<usize>; 4]; 2], head: usize) -> Option<Vector3<f64>> {
        let [mut up, mut forward] = [Vector3::zeros(); 2];
        for [_, _, ankle, toe] in legs {
            let toe = toe.map(|toe| self.positions[toe]);
            let toe = toe.or_else(|| self.tips[ankle?])?;
            let ankle = self.positions[ankle?];
            up += self.positions[head] - ankle;
            forward += toe - ankle;
        }
        Some(up.cross(&forward))
    }

    /// Where the two longest bones in a row of a limb end: ankle or wrist.
    fn end_of_longest(&self, chain: &[usize]) -> usize {
        let length = |at: usize| self.clip.joints()[chain[at]].rest_in_parent.norm();
        let both = |at: &usize| length(*at) + length(*at - 1);
        let ends = (2..chain.len()).max_by(|a, b| both(a).total_cmp(&both(b)));
        ends.unwrap_or(2)
    }

    /// Hip, knee, ankle and toe of a leg.
    fn leg(&self, from: usize) -> [Option<usize>; 4] {
        let chain = self.chain(from);
        let named = chain
            .iter()
            .position(|it| self.says(*it, &["foot", "ankle"]));
        let ankle = named.filter(|at| *at >= 2);
        let ankle = ankle.unwrap_or_else(|| self.end_of_longest(&chain));
        [ankle - 2, ankle - 1, ankle, ankle + 1].map(|at| chain.get(at).copied())
    }

    /// Collar, shoulder, elbow and wrist of an arm.
    fn arm(&self, from: usize) -> [Option<usize>; 4] {
        let chain = self.chain(from);
        let named = chain
            .iter()
            .position(|it| self.says(*it, &["hand", "wrist"]));
        let wrist = named.filter(|at| *at >= 2);
        let wrist = wrist.unwrap_or_else(|| self.end_of_longest(&chain));
        let at = |back: usize| {
            wrist
                .checked_sub(back)
                .and_then(|at| chain.get(at).copied())
        };
        [at(3), at(2), at(1), at(0)]
    }

    fn assign(&self) -> [Option<usize>; JOINT_COUNT] {
        let mut found = [None; JOINT_COUNT];
        let Some((hips, legs)) = (0..self.sizes.len()).find_map(|it| Some((it, self.limbs(it)?)))
        else {
            return found;
        };
        let Some((pelvis, trunk)) = self.trunk(hips, legs) else {
            return found;
        };
        found[Joint::Pelvis.index()] = Some(pelvis);
        let Some((mut chest, arms)) = trunk
            .iter()
            .find_map(|joint| Some((*joint, self.limbs(*joint)?)))
        else {
            return found;
        };
        let above = self.children[chest].iter().filter(|it| !arms.contains(it));
        let mut above = above
            .max_by_key(|child| self.sizes[**child])
            .map_or_else(Vec::new, |child| self.chain(*child));
        let mut spine: Vec<usize> = trunk.into_iter().take_while(|it| *it != chest).collect();
        // Some skeletons hang the arms on the neck.
        if self.says(chest, &["neck"])
            && let Some(below) = spine.pop()
        {
            above.insert(0, chest);
            chest = below;
        }
        found[Joint::Spine3.index()] = Some(chest);
        self.spine(&spine, &mut found);
        self.head(&above, &mut found);
        let left = self.left(
            legs.map(|leg| self.leg(leg)),
            *above.last().unwrap_or(&chest),
        );
        let legs = self.sides(legs, left).map(|leg| self.leg(leg));
        let arms = self.sides(arms, left).map(|arm| self.arm(arm));
        for (side, names) in LIMBS.into_iter().enumerate() {
            let limbs = legs[side].into_iter().chain(arms[side]);
            for (joint, at) in names.into_iter().zip(limbs) {
                found[joint.index()] = at;
            }
        }
        found
    }

    /// The pelvis, and the way from it upwards.
    fn trunk(&self, hips: usize, legs: [usize; 2]) -> Option<(usize, Vec<usize>)> {
        let parent = self.clip.joints()[hips].parent;
        [Some(hips), parent]
            .into_iter()
            .flatten()
            .find_map(|pelvis| {
                let others = self.children[pelvis]
                    .iter()
                    .filter(|child| !legs.contains(child) && **child != hips);
                let trunk = others.max_by_key(|child| self.sizes[**child])?;
                let chain = self.chain(*trunk);
                (self.sizes[*trunk] > 2 * LEAST_LIMB).then_some((pelvis, chain))
            })
    }

    /// What is between pelvis and chest; of a single joint the middle one.
    fn spine(&self, between: &[usize], found: &mut [Option<usize>; JOINT_COUNT]) {
        match between {
            [] => {}
            [one] => found[Joint::Spine2.index()] = Some(*one),
            [first, .., last] => {
                found[Joint::Spine1.index()] = Some(*first);
                let middle = between.get(between.len() / 2).unwrap_or(last);
                found[Joint::Spine2.index()] = Some(*middle);
            }
        }
    }

    fn head(&self, above: &[usize], found: &mut [Option<usize>; JOINT_COUNT]) {
        let named = above.iter().position(|joint| self.says(*joint, &["head"]));
        let head = named.or((above.len() >= 2).then_some(1));
        found[Joint::Head.index()] = head.map(|at| above[at]);
        if head != Some(0) {
            found[Joint::Neck.index()] = above.first().copied();
        }
    }
}

/// Leg and arm of the left and the right side, as [`Tree::leg`] and [`Tree::arm`] give them.
const LIMBS: [[Joint; 8]; 2] = [
    [
        Joint::LeftHip,
        Joint::LeftKnee,
        Joint::LeftAnkle,
        Joint::LeftFoot,
        Joint::LeftCollar,
        Joint::LeftShoulder,
        Joint::LeftElbow,
        Joint::LeftWrist,
    ],
    [
        Joint::RightHip,
        Joint::RightKnee,
        Joint::RightAnkle,
        Joint::RightFoot,
        Joint::RightCollar,
        Joint::RightShoulder,
        Joint::RightElbow,
        Joint::RightWrist,
    ],
];
