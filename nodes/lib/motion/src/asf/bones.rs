//! From the bones and the hierarchy of a file to bones in order, parents first.

use nalgebra::{UnitQuaternion, Vector3};

use super::skeleton::AsfBone;
use crate::MotionError;
use crate::text::{Cursor, Token};

/// What a bone of `:bonedata` says; turned into an [`AsfBone`] once the hierarchy is known.
pub(super) struct RawBone {
    pub name: String,
    pub direction: Vector3<f64>,
    pub length: f64,
    pub skeleton_from_bone: UnitQuaternion<f64>,
    pub freedoms: Vec<usize>,
    pub limits: Vec<[f64; 2]>,
    pub line: usize,
}

/// What `:bonedata` and `:hierarchy` say.
#[derive(Default)]
pub(super) struct RawBones<'a> {
    pub raw: Vec<RawBone>,
    /// Child's name, parent's name (`None` for the root), line.
    pub edges: Vec<(&'a str, Option<&'a str>, usize)>,
}

impl<'a> RawBones<'a> {
    /// Brings the bones into an order with parents first. Each bone must hang on the root, once.
    pub fn in_order(&self, cursor: &Cursor<'_>) -> Result<Vec<AsfBone>, MotionError> {
        let parents = self.parents(cursor)?;
        let (order, ranks) = parents_first(&parents);
        if let Some(loose) = (0..self.raw.len()).find(|&bone| ranks[bone].is_none()) {
            let bone = &self.raw[loose];
            return Err(cursor.unexpected(
                "a bone that hangs on the root",
                Some(Token {
                    text: &bone.name,
                    line: bone.line,
                }),
            ));
        }
        if order.is_empty() {
            return Err(cursor.unexpected(":bonedata and :hierarchy with bones", None));
        }
        let bone = |&index: &usize| {
            let raw = &self.raw[index];
            AsfBone {
                name: raw.name.clone(),
                parent: parents[index].flatten().and_then(|parent| ranks[parent]),
                rest_span: raw.direction.try_normalize(1e-12).unwrap_or_default() * raw.length,
                skeleton_from_bone: raw.skeleton_from_bone,
                freedoms: raw.freedoms.clone(),
                limits: raw.limits.clone(),
            }
        };
        Ok(order.iter().map(bone).collect())
    }

    /// For each bone of `:bonedata` its parent by `:hierarchy`.
    fn parents(&self, cursor: &Cursor<'_>) -> Result<Vec<Parent>, MotionError> {
        let known = |name: &'a str, line: usize| {
            self.raw
                .iter()
                .position(|bone| bone.name.eq_ignore_ascii_case(name))
                .ok_or_else(|| {
                    let found = Token { text: name, line };
                    cursor.unexpected("a bone of :bonedata", Some(found))
                })
        };
        let mut parents: Vec<Parent> = vec![None; self.raw.len()];
        for &(child, parent, line) in &self.edges {
            let index = known(child, line)?;
            let parent = parent.map(|parent| known(parent, line)).transpose()?;
            if parents[index].replace(parent).is_some() {
                let found = Token { text: child, line };
                return Err(cursor.unexpected("a bone with one parent", Some(found)));
            }
        }
        Ok(parents)
    }
}

/// `None` for a bone that hangs on nothing, `Some(None)` for one on the root, else the parent's
/// index.
type Parent = Option<Option<usize>>;

/// The bones in an order with parents first, and the rank of each in it. Breadth first, level by
/// level, so that a ring of bones ends the search rather than keeping it; its bones have no rank.
fn parents_first(parents: &[Parent]) -> (Vec<usize>, Vec<Option<usize>>) {
    let mut ranks: Vec<Option<usize>> = vec![None; parents.len()];
    let mut order = Vec::with_capacity(parents.len());
    loop {
        let ready = |bone: &usize| match parents[*bone] {
            Some(None) => ranks[*bone].is_none(),
            Some(Some(parent)) => ranks[*bone].is_none() && ranks[parent].is_some(),
            None => false,
        };
        let level: Vec<usize> = (0..parents.len()).filter(ready).collect();
        if level.is_empty() {
            return (order, ranks);
        }
        for bone in level {
            ranks[bone] = Some(order.len());
            order.push(bone);
        }
    }
}
