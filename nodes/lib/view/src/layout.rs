//! The layout that is shipped with a recording: body at the left, curves at the right.

use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::blueprint::archetypes::{
    Background, EyeControls3D, LineGrid3D, PlotLegend, SpatialInformation, TimeAxis,
    TimePanelBlueprint, VisibleTimeRanges,
};
use re_sdk_types::blueprint::components::{
    BackgroundKind, ContainerKind, Corner2D, Eye3DKind, LinkAxis, LoopMode, PanelState, PlayState,
};
use re_sdk_types::datatypes::{TimeInt, TimeRange, TimeRangeBoundary, VisibleTimeRange};

use crate::ViewError;
use crate::blueprint_store::{BlueprintStore, Part, Property, View};
use crate::style;

/// The one timeline.
pub(crate) const TIMELINE: &str = "time";
/// Parent of everything in space.
pub(crate) const WORLD: &str = "/world";
/// What the camera follows.
pub(crate) const ANCHOR: &str = "/world/anchor";
/// The two quantities of an IMU: last part of the path and title with unit.
pub(crate) const QUANTITIES: [(&str, &str); 2] = [
    ("specific_force", "specific force (m/s²)"),
    ("angular_velocity", "angular velocity (rad/s)"),
];

/// Where the camera looks from, m: before a body that faces along x, a little to its right, above
/// breast height.
const EYE: [f32; 3] = [2.26, -1.05, 1.4];
/// What it looks at, m: the middle of an adult at the origin. From there on it keeps its direction
/// and follows the anchor.
const TARGET: [f32; 3] = [0.0, 0.0, 0.88];
/// The anchor's points, m, over its place on the ground. The viewer follows the middle of their
/// bounding box from 1.5 times its diagonal away, whatever the distance from eye to target.
pub(crate) const ANCHOR_POINTS: [[f32; 3]; 2] =
    [[0.0, 0.0, TARGET[2] - 0.78], [0.0, 0.0, TARGET[2] + 0.78]];
/// Rows of curves that still can be read on one page; more placements than that are dealt to tabs.
const ROWS_PER_PAGE: usize = 6;

/// What the layout depends on.
pub(crate) struct Layout<'a> {
    /// The placements, one row of curves each.
    pub placements: &'a [String],
    /// Whether a viewer watches while data come.
    pub live: bool,
    /// Seconds of curves up to the time cursor; all where none.
    pub curve_window_s: Option<f64>,
}

/// The path of a placement's quantity; the name is one part of it, whatever characters it has.
pub(crate) fn imu_path(placement: &str, quantity: &str) -> EntityPath {
    EntityPath::new(vec!["imu".into(), placement.into(), quantity.into()])
}

/// The path of a placement's frame in space.
pub(crate) fn sensor_path(placement: &str) -> EntityPath {
    EntityPath::new(vec!["world".into(), "sensors".into(), placement.into()])
}

impl Layout<'_> {
    /// Writes the layout into the recording and makes it the one in use.
    pub(crate) fn send(&self, recording: &RecordingStream) -> Result<(), ViewError> {
        let store = BlueprintStore::new()?;
        let space = Self::space(&store)?;
        let root = match self.curves(&store)? {
            Some(curves) => store.container(
                ContainerKind::Horizontal,
                None,
                &[space, curves],
                &[1.0, 1.15],
            )?,
            None => store.container(ContainerKind::Horizontal, None, &[space], &[])?,
        };
        store.panel("blueprint_panel", PanelState::Hidden)?;
        store.panel("selection_panel", PanelState::Hidden)?;
        let play_state = if self.live {
            PlayState::Following
        } else {
            PlayState::Playing
        };
        let loop_mode = if self.live {
            LoopMode::Off
        } else {
            LoopMode::All
        };
        let time_panel = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(TIMELINE);
        store.log(
            "time_panel",
            &time_panel
                .with_play_state(play_state)
                .with_loop_mode(loop_mode),
        )?;
        store.send(&root, recording)
    }

    fn space(store: &BlueprintStore) -> Result<Part, ViewError> {
        let [red, green, blue, alpha] = style::GRID;
        let properties = vec![
            Property::new(
                Background::new(BackgroundKind::SolidColor).with_color(style::BACKGROUND),
            ),
            Property::new(
                LineGrid3D::new()
                    .with_visible(true)
                    .with_spacing(style::GRID_SPACING)
                    .with_stroke_width(1.0)
                    .with_color([red, green, blue, alpha]),
            ),
            Property::new(
                EyeControls3D::new()
                    .with_kind(Eye3DKind::Orbital)
                    .with_position(EYE)
                    .with_look_target(TARGET)
                    .with_eye_up([0.0, 0.0, 1.0])
                    .with_tracking_entity(ANCHOR),
            ),
            Property::new(
                SpatialInformation::update_fields()
                    .with_show_axes(false)
                    .with_show_bounding_box(false),
            ),
        ];
        let name = "body and sensors".into();
        store.view(&View {
            class: "3D",
            name,
            origin: &EntityPath::from(WORLD),
            contents: &["$origin/**"],
            properties,
        })
    }

    fn curves(&self, store: &BlueprintStore) -> Result<Option<Part>, ViewError> {
        let pages = self.placements.len().div_ceil(ROWS_PER_PAGE);
        let mut parts = Vec::with_capacity(pages);
        for page in 0..pages {
            // Pages of like size: 17 placements are 6 + 6 + 5.
            let (start, end) = (
                self.placements.len() * page / pages,
                self.placements.len() * (page + 1) / pages,
            );
            let placements = &self.placements[start..end];
            let rows = placements
                .iter()
                .enumerate()
                .map(|(row, name)| self.row(store, name, row == 0))
                .collect::<Result<Vec<_>, _>>()?;
            let name = format!("{} … {}", self.placements[start], self.placements[end - 1]);
            parts.push(store.container(ContainerKind::Vertical, Some(&name), &rows, &[])?);
        }
        if parts.len() > 1 {
            return Ok(Some(store.container(
                ContainerKind::Tabs,
                Some("IMUs"),
                &parts,
                &[],
            )?));
        }
        Ok(parts.pop())
    }

    fn row(
        &self,
        store: &BlueprintStore,
        placement: &str,
        with_legend: bool,
    ) -> Result<Part, ViewError> {
        let views = QUANTITIES.map(|(quantity, title)| {
            let mut properties = vec![Property::new(
                PlotLegend::new()
                    .with_corner(Corner2D::RightTop)
                    .with_visible(with_legend),
            )];
            match self.curve_window_s {
                None => properties.push(Property::new(
                    TimeAxis::new().with_link(LinkAxis::LinkToGlobal),
                )),
                Some(window) => properties.extend(window_properties(window)),
            }
            let (name, origin) = (
                format!("{placement} · {title}"),
                imu_path(placement, quantity),
            );
            store.view(&View {
                class: "TimeSeries",
                name,
                origin: &origin,
                contents: &["$origin/**"],
                properties,
            })
        });
        let [specific_force, angular_velocity] = views;
        store.container(
            ContainerKind::Horizontal,
            Some(placement),
            &[specific_force?, angular_velocity?],
            &[],
        )
    }
}

/// The last `window` seconds up to the time cursor, as what is fetched and as the axis.
fn window_properties(window_s: f64) -> [Property; 2] {
    let range = TimeRange {
        start: TimeRangeBoundary::CursorRelative(TimeInt((-window_s * 1e9) as i64)),
        end: TimeRangeBoundary::CursorRelative(TimeInt(0)),
    };
    let visible = VisibleTimeRange {
        timeline: TIMELINE.into(),
        range,
    };
    [
        Property::new(VisibleTimeRanges::new([visible])),
        Property::new(TimeAxis::new().with_view_range(range)),
    ]
}
