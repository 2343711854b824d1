//! The body as it is shown: a coarser mesh over some of the body's own vertices, and its normals.

use crate::ViewError;
use crate::reduce::reduce;

/// A mesh over a subset of a body's vertices. The subset is chosen once, on the rest shape; later
/// frames only pick those vertices.
#[derive(Clone, Debug)]
pub struct DisplayMesh {
    body_vertex_count: usize,
    kept: Vec<u32>,
    faces: Vec<[u32; 3]>,
}

impl DisplayMesh {
    /// Reduces a closed mesh to at most about `most_vertices` of its vertices (quadric error
    /// metric, Garland and Heckbert 1997, with collapses onto existing vertices only, so that any
    /// pose of the body is a pose of the reduced mesh). 0 keeps all.
    ///
    /// `rest_vertices`: (V, 3), m; `faces`: (F, 3), outward.
    ///
    /// # Errors
    /// [`ViewError::Face`] where a face names a vertex that is not there.
    pub fn new(
        rest_vertices: &[[f32; 3]],
        faces: &[[u32; 3]],
        most_vertices: usize,
    ) -> Result<Self, ViewError> {
        let vertex_count = rest_vertices.len();
        for (face, corners) in faces.iter().enumerate() {
            if let Some(&vertex) = corners
                .iter()
                .find(|&&vertex| vertex as usize >= vertex_count)
            {
                return Err(ViewError::Face {
                    face,
                    vertex,
                    vertex_count,
                });
            }
        }
        let target = if most_vertices == 0 {
            vertex_count
        } else {
            most_vertices
        };
        let faces = if target < vertex_count {
            reduce(rest_vertices, faces, target)
        } else {
            faces.to_vec()
        };
        let mut used = vec![false; vertex_count];
        faces
            .iter()
            .flatten()
            .for_each(|&vertex| used[vertex as usize] = true);
        let kept: Vec<u32> = (0..vertex_count as u32)
            .filter(|&vertex| used[vertex as usize])
            .collect();
        let mut index_in_kept = vec![0; vertex_count];
        for (index, &vertex) in kept.iter().enumerate() {
            index_in_kept[vertex as usize] = index as u32;
        }
        let faces = faces
            .iter()
            .map(|corners| corners.map(|vertex| index_in_kept[vertex as usize]))
            .collect();
        Ok(Self {
            body_vertex_count: vertex_count,
            kept,
            faces,
        })
    }

    /// The body's vertices that are shown, ascending.
    pub fn kept_vertices(&self) -> &[u32] {
        &self.kept
    }

    /// The faces, as indices into [`Self::kept_vertices`].
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The shown ones among all the body's vertices.
    ///
    /// # Errors
    /// [`ViewError::Count`] where there are more or fewer than at the start.
    pub fn pick(&self, body_vertices: &[[f32; 3]]) -> Result<Vec<[f32; 3]>, ViewError> {
        if body_vertices.len() != self.body_vertex_count {
            return Err(ViewError::Count {
                what: "body vertices",
                expected: self.body_vertex_count,
                found: body_vertices.len(),
            });
        }
        Ok(self
            .kept
            .iter()
            .map(|&vertex| body_vertices[vertex as usize])
            .collect())
    }

    /// The unit normals of shown vertices: the mean of their faces' normals, weighted by area; (0,
    /// 0, 1) where that vanishes.
    pub fn normals(&self, shown_vertices: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let mut sums = vec![[0.0_f32; 3]; shown_vertices.len()];
        for corners in &self.faces {
            let [a, b, c] = corners.map(|vertex| shown_vertices[vertex as usize]);
            let normal = cross(minus(b, a), minus(c, a));
            for &vertex in corners {
                let sum = &mut sums[vertex as usize];
                *sum = [sum[0] + normal[0], sum[1] + normal[1], sum[2] + normal[2]];
            }
        }
        for sum in &mut sums {
            let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
            *sum = if length > 0.0 {
                sum.map(|value| value / length)
            } else {
                [0.0, 0.0, 1.0]
            };
        }
        sums
    }
}

fn minus(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::reduce::tests::sphere;

    #[test]
    fn normals_of_a_sphere_point_outwards() {
        let (vertices, faces) = sphere(40, 40);
        let mesh = DisplayMesh::new(&vertices, &faces, 0).unwrap();
        assert_eq!(mesh.kept_vertices().len(), vertices.len());
        for (vertex, normal) in vertices
            .iter()
            .zip(mesh.normals(&mesh.pick(&vertices).unwrap()))
        {
            let cosine: f32 = (0..3).map(|axis| vertex[axis] * normal[axis]).sum();
            assert!(cosine > 0.999, "{vertex:?} {normal:?}");
        }
    }

    #[test]
    fn reduced_faces_index_the_kept_vertices() {
        let (vertices, faces) = sphere(40, 40);
        let mesh = DisplayMesh::new(&vertices, &faces, 400).unwrap();
        assert!(mesh.kept_vertices().len() <= 400);
        assert!(
            mesh.kept_vertices()
                .windows(2)
                .all(|pair| pair[0] < pair[1])
        );
        assert!(
            mesh.faces()
                .iter()
                .flatten()
                .all(|&vertex| (vertex as usize) < mesh.kept_vertices().len())
        );
        let picked = mesh.pick(&vertices).unwrap();
        assert_eq!(picked[7], vertices[mesh.kept_vertices()[7] as usize]);
    }

    #[test]
    fn a_face_beyond_the_vertices_is_named() {
        let error = DisplayMesh::new(&[[0.0; 3]; 3], &[[0, 1, 2], [0, 1, 3]], 0).unwrap_err();
        assert_eq!(
            error.to_string(),
            "face 1: vertex 3 is not one of the 3 vertices"
        );
    }

    #[test]
    fn a_frame_of_another_body_is_refused() {
        let mesh = DisplayMesh::new(&[[0.0; 3]; 3], &[[0, 1, 2]], 0).unwrap();
        let error = mesh.pick(&[[0.0; 3]; 4]).unwrap_err();
        assert_eq!(error.to_string(), "body vertices: expected 3, found 4");
    }
}
