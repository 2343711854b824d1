//! A shot that the test makes itself: a known motion before a moving camera, as keypoints, depth
//! maps, cameras and in-place poses with errors of published size.

pub mod files;

use cromosim_body::{BodyModel, BodyPose, Gender, Joint, ShapedBody};
use cromosim_motion::SmplMotion;
use cromosim_video::{BODY_25_COUNT, Camera, CameraClip, DepthMap, Keypoint, PersonKeypoints};
use nalgebra::{Isometry3, UnitQuaternion, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub const RATE_HZ: f64 = 30.0;
const IMAGE_PX: [f64; 2] = [1920.0, 1080.0];
const FOCAL_PX: f64 = 1500.0;
/// Robust CVD works at 384 columns.
pub const MAP_PX: [usize; 2] = [384, 216];

/// Sizes of the errors, with where they come from.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// px at 1080 rows, white from frame to frame. OpenPose's heat maps have cells of 8 px at 368
    /// rows (23 px at 1080), which it interpolates; 5 to 10 px is what its users report.
    pub keypoint_px: f64,
    /// Keypoints beside the joints by this, fixed to the body, m: annotators click at another place
    /// than SMPL's joint.
    pub keypoint_offset_m: f64,
    /// Scale of single depth maps, slow (below 0.3 Hz) and without a mean, which would be the
    /// global scale.
    pub depth_scale: f64,
    /// Scale of single depth maps from frame to frame.
    pub depth_flicker: f64,
    /// Single pixels of a depth map.
    pub depth_pixel: f64,
    /// Joint angles, slow, deg: VIBE's mean joint error on 3DPW is 83 mm, 52 mm after Procrustes
    /// (Kocabas et al. 2020, table 1).
    pub pose_slow_deg: f64,
    /// Joint angles from frame to frame, deg.
    pub pose_white_deg: f64,
    /// Camera orientation, slow, deg, and position, m: what structure from motion leaves.
    pub camera_deg: f64,
    pub camera_m: f64,
    /// Share of frames without the person, in bursts.
    pub dropout: f64,
    /// Share of frames with a keypoint on something else.
    pub outliers: f64,
}

pub const PUBLISHED: Errors = Errors {
    keypoint_px: 7.0,
    keypoint_offset_m: 0.01,
    depth_scale: 0.05,
    depth_flicker: 0.01,
    depth_pixel: 0.02,
    pose_slow_deg: 7.0,
    pose_white_deg: 2.0,
    camera_deg: 0.3,
    camera_m: 0.01,
    dropout: 0.10,
    outliers: 0.02,
};

pub const NONE: Errors = Errors {
    keypoint_px: 0.0,
    keypoint_offset_m: 0.0,
    depth_scale: 0.0,
    depth_flicker: 0.0,
    depth_pixel: 0.0,
    pose_slow_deg: 0.0,
    pose_white_deg: 0.0,
    camera_deg: 0.0,
    camera_m: 0.0,
    dropout: 0.0,
    outliers: 0.0,
};

/// A shot, and what is true of it.
pub struct Shot {
    pub clip: CameraClip,
    pub depths: Vec<Option<DepthMap>>,
    /// The motion at the shot's rate, in its own world (z up, floor at 0).
    pub truth: Vec<BodyPose>,
    /// The reconstruction's world, before its wrong scale, from the motion's.
    pub source_from_world: Isometry3<f64>,
    /// Mean distance of the estimator's joints from the true ones, root at root, m: with and
    /// without the root's orientation.
    pub pose_error_m: [f64; 2],
}

pub struct Random(ChaCha8Rng);

impl Random {
    pub fn normal(&mut self) -> f64 {
        let (u, v): (f64, f64) = (self.0.random(), self.0.random());
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.normal())
    }

    /// A signal of frequencies up to 0.3 Hz with standard deviation 1 and mean 0 over its length.
    fn slow(&mut self, count: usize) -> Vec<f64> {
        let waves: Vec<[f64; 3]> = (0..6)
            .map(|_| {
                [
                    0.05 + 0.25 * self.0.random::<f64>(),
                    std::f64::consts::TAU * self.0.random::<f64>(),
                    self.normal(),
                ]
            })
            .collect();
        let at = |frame: usize| -> f64 {
            waves
                .iter()
                .map(|[hz, phase, size]| {
                    size * (std::f64::consts::TAU * hz * frame as f64 / RATE_HZ + phase).sin()
                })
                .sum()
        };
        let mut values: Vec<f64> = (0..count).map(at).collect();
        let mean = values.iter().sum::<f64>() / count as f64;
        values.iter_mut().for_each(|value| *value -= mean);
        let std = (values.iter().map(|value| value * value).sum::<f64>() / count as f64).sqrt();
        values.iter_mut().for_each(|value| *value /= std);
        values
    }

    fn slow_vectors(&mut self, count: usize) -> Vec<Vector3<f64>> {
        let axes: [Vec<f64>; 3] = std::array::from_fn(|_| self.slow(count));
        (0..count)
            .map(|frame| Vector3::from_fn(|axis, _| axes[axis][frame]))
            .collect()
    }
}

/// The motion seen by a hand-held camera that walks along at about four metres, reconstructed at
/// `scale` times its size.
pub fn shoot(motion: &SmplMotion, errors: &Errors, scale: f64, seed: u64) -> Shot {
    let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
    let motion = motion.resampled(RATE_HZ).unwrap();
    let shaped = ShapedBody::new(BodyModel::embedded(), &motion.betas).unwrap();
    let truth = motion.frames.clone();
    let count = truth.len();
    let true_cameras = cameras(&truth);
    // The reconstruction's world is the first camera's, as usual, at another place.
    let source_from_world =
        Isometry3::new(Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.02, 0.4, -0.03))
            * true_cameras[0].world_from_camera.inverse();
    let depths = render_all(&truth, &true_cameras, &shaped, errors, scale, &mut random);
    let mut keypoints = keypoints(&truth, &true_cameras, &shaped, errors, &mut random);
    drop_out(&mut keypoints, errors, &mut random);
    let (poses, pose_error_m) = poses(&truth, &true_cameras, &shaped, errors, &mut random);
    let (turns, shifts) = (random.slow_vectors(count), random.slow_vectors(count));
    let given = |frame: usize, camera: &Camera| {
        let mut pose = source_from_world * camera.world_from_camera;
        pose.translation.vector =
            (pose.translation.vector + shifts[frame] * errors.camera_m) * scale;
        pose.rotation *=
            UnitQuaternion::from_scaled_axis(turns[frame] * errors.camera_deg.to_radians());
        Some(
            Camera {
                world_from_camera: pose,
                ..*camera
            }
            .resized(Vector2::new(MAP_PX[0] as f64, MAP_PX[1] as f64)),
        )
    };
    let betas = (0..count).map(|_| {
        motion
            .betas
            .iter()
            .map(|beta| {
                beta + if errors.pose_slow_deg > 0.0 {
                    0.3 * random.normal()
                } else {
                    0.0
                }
            })
            .collect()
    });
    let clip = CameraClip {
        name: "shot".to_owned(),
        rate_hz: RATE_HZ,
        gender: Gender::Neutral,
        pose_confidence: vec![1.0; count],
        betas: betas.collect(),
        keypoint_image_px: Vector2::from(IMAGE_PX),
        cameras: true_cameras
            .iter()
            .enumerate()
            .map(|(frame, camera)| given(frame, camera))
            .collect(),
        keypoints,
        poses,
    };
    Shot {
        clip,
        depths,
        truth,
        source_from_world,
        pose_error_m,
    }
}

/// Four metres beside the person and somewhat behind, 1.4 m high, with the steps and sway of who
/// holds it, looking at them with a lag.
fn cameras(truth: &[BodyPose]) -> Vec<Camera> {
    let start = truth[0].root_position;
    let mut look = start;
    let mut follow = start;
    truth
        .iter()
        .enumerate()
        .map(|(frame, pose)| {
            let t = frame as f64 / RATE_HZ;
            look += (pose.root_position - look) * 0.1;
            follow += (pose.root_position - follow) * 0.03;
            let sway =
                Vector3::new((5.1 * t).sin(), (3.3 * t + 1.0).sin(), (10.7 * t).sin()) * 0.03;
            let eye =
                Vector3::new(follow.x - 1.0 + 0.5 * (0.3 * t).sin(), follow.y - 4.0, 1.4) + sway;
            let forward = (Vector3::new(look.x, look.y, 0.9) + sway * 0.5 - eye).normalize();
            let right = forward.cross(&Vector3::z()).normalize();
            let rotation =
                nalgebra::Matrix3::from_columns(&[right, forward.cross(&right), forward]);
            let world_from_camera =
                Isometry3::from_parts(eye.into(), UnitQuaternion::from_matrix(&rotation));
            Camera::centred(
                Vector2::repeat(FOCAL_PX),
                Vector2::from(IMAGE_PX),
                world_from_camera,
            )
        })
        .collect()
}

/// BODY_25's points on the skeleton; face and toes are left out, as nothing reads them.
fn body_points(shaped: &ShapedBody, pose: &BodyPose) -> Vec<(usize, Vector3<f64>)> {
    let segments = shaped.world_from_segments(pose);
    let at = |joint: Joint| segments[joint.index()].translation.vector;
    let middle = |a: Joint, b: Joint| (at(a) + at(b)) / 2.0;
    let mut points = vec![
        (1, middle(Joint::LeftShoulder, Joint::RightShoulder)),
        (8, middle(Joint::LeftHip, Joint::RightHip)),
    ];
    let limbs = [
        (2, Joint::RightShoulder),
        (3, Joint::RightElbow),
        (4, Joint::RightWrist),
        (5, Joint::LeftShoulder),
        (6, Joint::LeftElbow),
        (7, Joint::LeftWrist),
        (9, Joint::RightHip),
        (10, Joint::RightKnee),
        (11, Joint::RightAnkle),
        (12, Joint::LeftHip),
        (13, Joint::LeftKnee),
        (14, Joint::LeftAnkle),
    ];
    points.extend(limbs.map(|(index, joint)| (index, at(joint))));
    points
}

fn keypoints(
    truth: &[BodyPose],
    cameras: &[Camera],
    shaped: &ShapedBody,
    errors: &Errors,
    random: &mut Random,
) -> Vec<Option<PersonKeypoints>> {
    let offsets: Vec<Vector3<f64>> = (0..BODY_25_COUNT)
        .map(|_| random.vector() * errors.keypoint_offset_m)
        .collect();
    let frame = |(pose, camera): (&BodyPose, &Camera)| {
        let mut person = [Keypoint::default(); BODY_25_COUNT];
        for (index, point) in body_points(shaped, pose) {
            let in_camera = camera.world_from_camera.inverse()
                * nalgebra::Point3::from(point + pose.local_rotations[0] * offsets[index]);
            let Some(pixel) = camera.project(&in_camera.coords) else {
                continue;
            };
            // Surer points are more exact, as in OpenPose.
            let confidence = (0.8 + 0.1 * random.normal()).clamp(0.35, 0.98);
            let spread = errors.keypoint_px * 0.8 / confidence;
            person[index] = Keypoint {
                u: pixel.x + spread * random.normal(),
                v: pixel.y + spread * random.normal(),
                confidence,
            };
        }
        Some(person)
    };
    truth.iter().zip(cameras).map(frame).collect()
}

/// Bursts of 3 to 15 frames without the person, or with low confidence; single frames with the hips
/// on something else.
fn drop_out(keypoints: &mut [Option<PersonKeypoints>], errors: &Errors, random: &mut Random) {
    let count = keypoints.len();
    let mut dropped = 0;
    while (dropped as f64) < errors.dropout * count as f64 {
        let start = (random.0.random::<f64>() * count as f64) as usize;
        let length = 3 + (random.0.random::<f64>() * 13.0) as usize;
        let unsure = random.0.random::<f64>() < 0.5;
        for person in keypoints.iter_mut().skip(start).take(length) {
            dropped += 1;
            match person {
                Some(points) if unsure => {
                    points.iter_mut().for_each(|point| point.confidence *= 0.2)
                }
                person => *person = None,
            }
        }
    }
    for person in keypoints.iter_mut().flatten() {
        if random.0.random::<f64>() < errors.outliers {
            let (du, dv) = (150.0 * random.normal(), 150.0 * random.normal());
            for index in [8, 9, 12] {
                person[index].u += du;
                person[index].v += dv;
            }
        }
    }
}

/// What the estimator says: camera_from_pelvis and joint angles with errors.
fn poses(
    truth: &[BodyPose],
    cameras: &[Camera],
    shaped: &ShapedBody,
    errors: &Errors,
    random: &mut Random,
) -> (Vec<BodyPose>, [f64; 2]) {
    let slow: Vec<Vec<Vector3<f64>>> = (0..24).map(|_| random.slow_vectors(truth.len())).collect();
    let mut distance = [0.0; 2];
    let poses = truth
        .iter()
        .zip(cameras)
        .enumerate()
        .map(|(frame, (pose, camera))| {
            let mut given = BodyPose {
                root_position: Vector3::zeros(),
                ..pose.clone()
            };
            for (joint, slow) in slow.iter().enumerate() {
                // Degrees are those of the angle, hence each axis has its share.
                let error =
                    slow[frame] * errors.pose_slow_deg + random.vector() * errors.pose_white_deg;
                given.local_rotations[joint] *=
                    UnitQuaternion::from_scaled_axis(error.map(f64::to_radians) / 3.0_f64.sqrt());
            }
            let with_root = mean_distance(shaped, &given, pose);
            let root = pose.local_rotations[0];
            let without = BodyPose {
                local_rotations: std::array::from_fn(|joint| {
                    if joint == 0 {
                        root
                    } else {
                        given.local_rotations[joint]
                    }
                }),
                ..given.clone()
            };
            distance[0] += with_root / truth.len() as f64;
            distance[1] += mean_distance(shaped, &without, pose) / truth.len() as f64;
            given.local_rotations[0] =
                camera.world_from_camera.rotation.inverse() * given.local_rotations[0];
            given
        })
        .collect();
    (poses, distance)
}

fn mean_distance(shaped: &ShapedBody, given: &BodyPose, truth: &BodyPose) -> f64 {
    let moved = BodyPose {
        root_position: truth.root_position,
        ..given.clone()
    };
    let pairs = shaped
        .world_from_segments(&moved)
        .into_iter()
        .zip(shaped.world_from_segments(truth));
    pairs
        .map(|(a, b)| (a.translation.vector - b.translation.vector).norm())
        .sum::<f64>()
        / 24.0
}

fn render_all(
    truth: &[BodyPose],
    cameras: &[Camera],
    shaped: &ShapedBody,
    errors: &Errors,
    scale: f64,
    random: &mut Random,
) -> Vec<Option<DepthMap>> {
    let slow = random.slow(truth.len());
    let mut vertices = Vec::new();
    let frame = |(frame, (pose, camera)): (usize, (&BodyPose, &Camera))| {
        shaped.skin(pose, &mut vertices);
        let exact = render(
            &vertices,
            shaped.model().faces(),
            &camera.resized(Vector2::new(MAP_PX[0] as f64, MAP_PX[1] as f64)),
        );
        let factor = scale
            * (1.0 + errors.depth_scale * slow[frame])
            * (1.0 + errors.depth_flicker * random.normal());
        let noisy = exact
            .into_iter()
            .map(|depth| (depth * factor * (1.0 + errors.depth_pixel * random.normal())) as f32)
            .collect();
        DepthMap::new(MAP_PX[0], MAP_PX[1], noisy)
    };
    truth.iter().zip(cameras).enumerate().map(frame).collect()
}

/// Depths along the optical axis of a mesh before a floor at z = 0 and a wall 3 m behind the path,
/// by a z-buffer.
pub fn render(vertices: &[[f32; 3]], faces: &[[u32; 3]], camera: &Camera) -> Vec<f64> {
    let [width, height] = MAP_PX;
    let mut depths = background(camera);
    let camera_from_world = camera.world_from_camera.inverse();
    let points: Vec<Option<(Vector2<f64>, f64)>> = vertices
        .iter()
        .map(|vertex| {
            let in_camera =
                (camera_from_world * nalgebra::Point3::from(vertex.map(f64::from))).coords;
            camera.project(&in_camera).map(|pixel| (pixel, in_camera.z))
        })
        .collect();
    for face in faces {
        let [Some((a, az)), Some((b, bz)), Some((c, cz))] =
            face.map(|vertex| points[vertex as usize])
        else {
            continue;
        };
        let area = (b - a).perp(&(c - a));
        let bound = |of: fn(&Vector2<f64>) -> f64, size: usize| {
            let low = of(&a)
                .min(of(&b))
                .min(of(&c))
                .floor()
                .clamp(0.0, size as f64) as usize;
            low..of(&a)
                .max(of(&b))
                .max(of(&c))
                .ceil()
                .clamp(0.0, size as f64) as usize
        };
        for row in bound(|p| p.y, height) {
            for column in bound(|p| p.x, width) {
                let p = Vector2::new(column as f64 + 0.5, row as f64 + 0.5);
                let weights = [
                    (c - b).perp(&(p - b)) / area,
                    (a - c).perp(&(p - c)) / area,
                    (b - a).perp(&(p - a)) / area,
                ];
                if weights.iter().all(|weight| *weight >= 0.0) {
                    // Inverse depths are linear in the image.
                    let depth = 1.0 / (weights[0] / az + weights[1] / bz + weights[2] / cz);
                    let pixel = &mut depths[row * width + column];
                    *pixel = pixel.min(depth);
                }
            }
        }
    }
    depths
}

fn background(camera: &Camera) -> Vec<f64> {
    let [width, height] = MAP_PX;
    let eye = camera.world_from_camera.translation.vector;
    (0..width * height)
        .map(|pixel| {
            let ray = camera.ray(Vector2::new(
                (pixel % width) as f64 + 0.5,
                (pixel / width) as f64 + 0.5,
            ));
            let direction = camera.world_from_camera.rotation * ray;
            let floor = if direction.z < 0.0 {
                -eye.z / direction.z
            } else {
                f64::MAX
            };
            let wall = if direction.y > 0.0 {
                (eye.y + 7.0 - eye.y) / direction.y
            } else {
                f64::MAX
            };
            floor.min(wall).min(60.0)
        })
        .collect()
}

/// A depth map as Robust CVD writes it: disparities.
pub fn disparity_file(map: &DepthMap) -> Vec<u8> {
    let disparities = map.depths().iter().map(|depth| files::disparity(*depth));
    files::raw_depth(map.width(), map.height(), disparities)
}

/// People of a frame as OpenPose writes them.
pub fn keypoint_file(people: &[PersonKeypoints]) -> String {
    let person = |points: &PersonKeypoints| {
        let numbers = points.map(|point| [point.u, point.v, point.confidence]);
        serde_json::json!({ "person_id": [-1], "pose_keypoints_2d": numbers.as_flattened() })
    };
    serde_json::json!({ "version": 1.3, "people": people.iter().map(person).collect::<Vec<_>>() })
        .to_string()
}
