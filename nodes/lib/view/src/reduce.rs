//! Mesh reduction by edge collapses in the order of their quadric error (Garland and Heckbert 1997,
//! "Surface simplification using quadric error metrics"). An edge collapses onto one of its ends,
//! never onto a new point.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::{Matrix4, Vector3, Vector4};

/// Cost, per area and squared edge length, that keeps triangles even on flat parts.
const LENGTH_WEIGHT: f64 = 1e-3;
/// A face may not turn further than the arc cosine of this in one collapse.
const LEAST_COSINE: f64 = 0.2;

/// The faces, over the same vertices, once at most `target` vertices are in use or no edge can
/// collapse any more.
pub(crate) fn reduce(vertices: &[[f32; 3]], faces: &[[u32; 3]], target: usize) -> Vec<[u32; 3]> {
    let mut mesh = Reduction::new(vertices, faces);
    let mut in_use = mesh
        .faces_of
        .iter()
        .filter(|faces| !faces.is_empty())
        .count();
    while in_use > target
        && let Some(collapse) = mesh.queue.pop()
    {
        let [from, onto] = [collapse.from as usize, collapse.onto as usize];
        let current = mesh.version[from] == collapse.versions[0]
            && mesh.version[onto] == collapse.versions[1];
        if current && mesh.may_collapse(collapse.from, collapse.onto) {
            mesh.collapse(collapse.from, collapse.onto);
            in_use -= 1;
        }
    }
    mesh.faces
        .into_iter()
        .zip(mesh.alive)
        .filter_map(|(face, alive)| alive.then_some(face))
        .collect()
}

/// A possible collapse, ordered so that the cheapest is the greatest.
struct Collapse {
    cost: f64,
    from: u32,
    onto: u32,
    versions: [u32; 2],
}

impl Ord for Collapse {
    fn cmp(&self, other: &Self) -> Ordering {
        // The indices decide ties, so that the result does not depend on the heap's inner order.
        other
            .cost
            .total_cmp(&self.cost)
            .then_with(|| (other.from, other.onto).cmp(&(self.from, self.onto)))
    }
}

impl PartialOrd for Collapse {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Collapse {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Collapse {}

struct Reduction {
    points: Vec<Vector3<f64>>,
    faces: Vec<[u32; 3]>,
    alive: Vec<bool>,
    /// The living faces of each vertex.
    faces_of: Vec<Vec<u32>>,
    /// Sum of the squared distances to the planes of the faces merged into a vertex, weighted by
    /// area.
    quadrics: Vec<Matrix4<f64>>,
    /// Area of those faces, m^2.
    areas: Vec<f64>,
    /// Counts the changes about a vertex, so that outdated collapses are known.
    version: Vec<u32>,
    queue: BinaryHeap<Collapse>,
}

impl Reduction {
    fn new(vertices: &[[f32; 3]], faces: &[[u32; 3]]) -> Self {
        let count = vertices.len();
        let mut mesh = Self {
            points: vertices
                .iter()
                .map(|&[x, y, z]| Vector3::new(x.into(), y.into(), z.into()))
                .collect(),
            faces: faces.to_vec(),
            alive: vec![true; faces.len()],
            faces_of: vec![Vec::new(); count],
            quadrics: vec![Matrix4::zeros(); count],
            areas: vec![0.0; count],
            version: vec![0; count],
            queue: BinaryHeap::new(),
        };
        for (index, &corners) in faces.iter().enumerate() {
            let normal = mesh.area_normal(corners);
            let (area, unit) = (
                normal.norm() / 2.0,
                normal.try_normalize(0.0).unwrap_or_else(Vector3::zeros),
            );
            let plane = Vector4::new(
                unit.x,
                unit.y,
                unit.z,
                -unit.dot(&mesh.points[corners[0] as usize]),
            );
            for vertex in corners.map(|vertex| vertex as usize) {
                mesh.faces_of[vertex].push(index as u32);
                mesh.quadrics[vertex] += plane * plane.transpose() * area;
                mesh.areas[vertex] += area;
            }
        }
        for vertex in 0..count as u32 {
            for neighbour in mesh.neighbours(vertex) {
                mesh.push(vertex, neighbour);
            }
        }
        mesh
    }

    /// Normal of a face, twice its area long.
    fn area_normal(&self, corners: [u32; 3]) -> Vector3<f64> {
        let [a, b, c] = corners.map(|vertex| self.points[vertex as usize]);
        (b - a).cross(&(c - a))
    }

    fn neighbours(&self, vertex: u32) -> Vec<u32> {
        let corners = self.faces_of[vertex as usize]
            .iter()
            .flat_map(|&face| self.faces[face as usize]);
        let mut neighbours: Vec<u32> = corners.filter(|&corner| corner != vertex).collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }

    fn push(&mut self, from: u32, onto: u32) {
        let [from_index, onto_index] = [from as usize, onto as usize];
        let point = self.points[onto_index].push(1.0);
        let planes = (self.quadrics[from_index] + self.quadrics[onto_index]) * point;
        let length = (self.points[onto_index] - self.points[from_index]).norm_squared();
        let cost = point.dot(&planes)
            + LENGTH_WEIGHT * length * (self.areas[from_index] + self.areas[onto_index]);
        self.queue.push(Collapse {
            cost,
            from,
            onto,
            versions: [self.version[from_index], self.version[onto_index]],
        });
    }

    /// Whether the surface stays a surface (the ends share exactly two neighbours, and no face
    /// comes to lie on another) and no face turns.
    fn may_collapse(&self, from: u32, onto: u32) -> bool {
        let others = self.neighbours(onto);
        let shared = self
            .neighbours(from)
            .iter()
            .filter(|neighbour| others.binary_search(neighbour).is_ok())
            .count();
        if shared != 2 {
            return false;
        }
        let moving = self.faces_of[from as usize]
            .iter()
            .map(|&face| self.faces[face as usize]);
        moving
            .filter(|corners| !corners.contains(&onto))
            .all(|corners| {
                let moved = corners.map(|vertex| if vertex == from { onto } else { vertex });
                let (before, after) = (self.area_normal(corners), self.area_normal(moved));
                let there = |&face: &u32| {
                    self.faces[face as usize]
                        .iter()
                        .all(|corner| moved.contains(corner))
                };
                before.dot(&after) > LEAST_COSINE * before.norm() * after.norm()
                    && !self.faces_of[onto as usize].iter().any(there)
            })
    }

    fn collapse(&mut self, from: u32, onto: u32) {
        let moved = std::mem::take(&mut self.faces_of[from as usize]);
        for face in moved {
            let corners = self.faces[face as usize];
            if corners.contains(&onto) {
                self.alive[face as usize] = false;
                for vertex in corners {
                    self.faces_of[vertex as usize].retain(|&other| other != face);
                }
            } else {
                self.faces[face as usize] =
                    corners.map(|vertex| if vertex == from { onto } else { vertex });
                self.faces_of[onto as usize].push(face);
            }
        }
        let (quadric, area) = (self.quadrics[from as usize], self.areas[from as usize]);
        self.quadrics[onto as usize] += quadric;
        self.areas[onto as usize] += area;
        self.version[from as usize] += 1;
        self.version[onto as usize] += 1;
        for neighbour in self.neighbours(onto) {
            self.push(onto, neighbour);
            self.push(neighbour, onto);
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::collections::HashMap;

    use super::*;

    /// A closed unit sphere of `rings` rings with `around` vertices each and two poles.
    pub(crate) fn sphere(rings: u32, around: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
        let mut vertices = vec![[0.0, 0.0, 1.0]];
        for ring in 0..rings {
            let polar = std::f64::consts::PI * f64::from(ring + 1) / f64::from(rings + 1);
            for step in 0..around {
                let azimuth = std::f64::consts::TAU * f64::from(step) / f64::from(around);
                let point = [
                    polar.sin() * azimuth.cos(),
                    polar.sin() * azimuth.sin(),
                    polar.cos(),
                ];
                vertices.push(point.map(|value| value as f32));
            }
        }
        let south = vertices.len() as u32;
        vertices.push([0.0, 0.0, -1.0]);
        let at = |ring: u32, step: u32| 1 + ring * around + step % around;
        let mut faces = Vec::new();
        for step in 0..around {
            faces.push([0, at(0, step), at(0, step + 1)]);
            faces.push([south, at(rings - 1, step + 1), at(rings - 1, step)]);
            for ring in 0..rings - 1 {
                faces.push([at(ring, step), at(ring + 1, step), at(ring + 1, step + 1)]);
                faces.push([at(ring, step), at(ring + 1, step + 1), at(ring, step + 1)]);
            }
        }
        (vertices, faces)
    }

    fn volume(vertices: &[[f32; 3]], faces: &[[u32; 3]]) -> f64 {
        let point = |vertex: u32| Vector3::from(vertices[vertex as usize].map(f64::from));
        faces
            .iter()
            .map(|&[a, b, c]| point(a).dot(&point(b).cross(&point(c))) / 6.0)
            .sum()
    }

    #[test]
    fn a_reduced_sphere_stays_closed_and_keeps_its_volume() {
        let (vertices, faces) = sphere(40, 40);
        let reduced = reduce(&vertices, &faces, 400);
        let mut edges = HashMap::new();
        for &[a, b, c] in &reduced {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((from, to)).or_insert(0) += 1;
            }
        }
        assert!(
            edges
                .iter()
                .all(|(&(from, to), &count)| count == 1 && edges.get(&(to, from)) == Some(&1))
        );
        // Euler: V - E + F = 2 with 2 E = 3 F.
        assert_eq!(reduced.len(), 2 * (400 - 2));
        let ratio = volume(&vertices, &reduced) / volume(&vertices, &faces);
        assert!((0.975..1.0).contains(&ratio), "volume ratio {ratio}");
    }

    #[test]
    fn reduction_is_repeatable() {
        let (vertices, faces) = sphere(20, 24);
        assert_eq!(
            reduce(&vertices, &faces, 100),
            reduce(&vertices, &faces, 100)
        );
    }

    #[test]
    fn an_open_or_tiny_mesh_is_left_whole() {
        let vertices = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        assert_eq!(reduce(&vertices, &tetrahedron, 2).len(), 4);
        assert_eq!(reduce(&vertices, &[[0, 1, 2]], 1), [[0, 1, 2]]);
    }
}
