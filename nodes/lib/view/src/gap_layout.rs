//! The layout of a diagnosis: words at the left, curves at the right, a tab for each placement.

use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::blueprint::archetypes::{
    Background, PlotLegend, TimeAxis, TimePanelBlueprint, VisualBounds2D,
};
use re_sdk_types::blueprint::components::{
    BackgroundKind, ContainerKind, Corner2D, LinkAxis, PanelState, PlayState,
};
use re_sdk_types::datatypes::{Range1D, Range2D};

use crate::blueprint_store::{BlueprintStore, Part, Property, View};
use crate::gap_data::{GAP_AXES, GapPlacement, gap_path};
use crate::gap_spectrum::{MARGIN, SIZE};
use crate::layout::TIMELINE;
use crate::{ViewError, style};

/// The page of words for all placements.
pub(crate) const SUMMARY: &str = "/gap/summary";

/// What the layout depends on.
pub(crate) struct GapLayout<'a> {
    pub placements: &'a [GapPlacement],
}

impl GapLayout<'_> {
    /// Writes the layout into the recording and makes it the one in use.
    pub(crate) fn send(&self, recording: &RecordingStream) -> Result<(), ViewError> {
        let store = BlueprintStore::new()?;
        let mut tabs = vec![words(&store, "summary", &EntityPath::from(SUMMARY))?];
        for placement in self.placements {
            tabs.push(Self::placement(&store, placement)?);
        }
        // A single placement needs no page before it.
        if let [_, placement] = tabs.as_slice()
            && self.placements.len() == 1
        {
            let root = store.container(
                ContainerKind::Vertical,
                None,
                std::slice::from_ref(placement),
                &[],
            )?;
            return Self::finish(store, &root, recording);
        }
        // Curves say more than a page of words; that is a click away.
        let root = store.tabs("placements", &tabs, 1)?;
        Self::finish(store, &root, recording)
    }

    fn finish(
        store: BlueprintStore,
        root: &Part,
        recording: &RecordingStream,
    ) -> Result<(), ViewError> {
        store.panel("blueprint_panel", PanelState::Hidden)?;
        store.panel("selection_panel", PanelState::Hidden)?;
        let time_panel = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(TIMELINE);
        store.log("time_panel", &time_panel.with_play_state(PlayState::Paused))?;
        store.send(root, recording)
    }

    fn placement(store: &BlueprintStore, placement: &GapPlacement) -> Result<Part, ViewError> {
        let name = placement.name.as_str();
        let mut left = vec![words(
            store,
            "verdict and causes",
            &gap_path(name, &["words"]),
        )?];
        let mut shares = vec![1.5];
        for (index, spectrum) in placement.spectra.iter().enumerate() {
            left.push(picture(
                store,
                &spectrum.title,
                &gap_path(name, &["spectrum", &index.to_string()]),
            )?);
            shares.push(1.0);
        }
        let left = store.container(ContainerKind::Vertical, None, &left, &shares)?;
        let curves = Self::grid(store, name, "curves")?;
        let residuals = Self::grid(store, name, "residual")?;
        let tabs = store.container(ContainerKind::Tabs, None, &[curves, residuals], &[])?;
        let course = |channel: &str, title: &str| {
            plot(
                store,
                format!("residual over time · {title} (dB, 0: noise alone)"),
                &gap_path(name, &["course", channel]),
                false,
            )
        };
        let courses = [
            course("accel", "accelerometer")?,
            course("gyro", "gyroscope")?,
        ];
        let courses = store.container(ContainerKind::Horizontal, None, &courses, &[])?;
        let right =
            store.container(ContainerKind::Vertical, None, &[tabs, courses], &[3.4, 1.0])?;
        store.container(
            ContainerKind::Horizontal,
            Some(name),
            &[left, right],
            &[1.0, 1.9],
        )
    }

    /// Accelerometer at the left, gyroscope at the right.
    fn grid(store: &BlueprintStore, name: &str, what: &str) -> Result<Part, ViewError> {
        let mut rows = Vec::with_capacity(3);
        for axis in 0..3 {
            let view = |axis: usize| {
                let (axis_name, unit) = GAP_AXES[axis];
                plot(
                    store,
                    format!("{axis_name} ({unit})"),
                    &gap_path(name, &[what, axis_name]),
                    axis == 3,
                )
            };
            rows.push(store.container(
                ContainerKind::Horizontal,
                None,
                &[view(axis)?, view(axis + 3)?],
                &[],
            )?);
        }
        let title = if what == "residual" {
            "residuals: measured less simulated"
        } else {
            "curves"
        };
        store.container(ContainerKind::Vertical, Some(title), &rows, &[])
    }
}

fn words(store: &BlueprintStore, name: &str, origin: &EntityPath) -> Result<Part, ViewError> {
    store.view(&View {
        class: "TextDocument",
        name: name.to_owned(),
        origin,
        contents: &["$origin/**"],
        properties: Vec::new(),
    })
}

/// The legend stands in one plot of a page: it covers curves, and the colours are the same
/// everywhere.
fn plot(
    store: &BlueprintStore,
    name: String,
    origin: &EntityPath,
    with_legend: bool,
) -> Result<Part, ViewError> {
    let properties = vec![
        Property::new(
            PlotLegend::new()
                .with_corner(Corner2D::RightTop)
                .with_visible(with_legend),
        ),
        Property::new(TimeAxis::new().with_link(LinkAxis::LinkToGlobal)),
    ];
    store.view(&View {
        class: "TimeSeries",
        name,
        origin,
        contents: &["$origin/**"],
        properties,
    })
}

fn picture(store: &BlueprintStore, name: &str, origin: &EntityPath) -> Result<Part, ViewError> {
    let [left, top, right, bottom] = MARGIN.map(f64::from);
    let [width, height] = SIZE.map(f64::from);
    let bounds = Range2D {
        x_range: Range1D([-left, width + right]),
        y_range: Range1D([-top, height + bottom]),
    };
    let properties = vec![
        Property::new(Background::new(BackgroundKind::SolidColor).with_color(style::BACKGROUND)),
        Property::new(VisualBounds2D::new(bounds)),
    ];
    store.view(&View {
        class: "2D",
        name: name.to_owned(),
        origin,
        contents: &["$origin/**"],
        properties,
    })
}
