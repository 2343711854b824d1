//! Writes a viewer layout as the messages of a blueprint store.
//!
//! The SDK's own layout builder cannot set the properties of a view (camera, floor, axes), so the
//! blueprint archetypes are logged here directly: a container or view stands at `container/UUID` or
//! `view/UUID`, a view's properties under it by archetype name.

use re_sdk::external::re_log_types::BlueprintActivationCommand;
use re_sdk::log::LogMsg;
use re_sdk::sink::MemorySinkStorage;
use re_sdk::{AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, StoreId};
use re_sdk_types::Archetype;
use re_sdk_types::blueprint::archetypes::{
    ContainerBlueprint, PanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use re_sdk_types::blueprint::components::{ContainerKind, PanelState, RootContainer};
use re_sdk_types::datatypes::Uuid;

use crate::ViewError;
use crate::sinks::APPLICATION;

/// Where the viewer looks for a new blueprint's values.
const TIMELINE: &str = "blueprint";

/// A blueprint store being written.
pub(crate) struct BlueprintStore {
    stream: RecordingStream,
    storage: MemorySinkStorage,
}

/// A container or a view that was written.
pub(crate) struct Part {
    id: Uuid,
    path: String,
}

/// A property of a view: its archetype's name and value.
pub(crate) struct Property(&'static str, Box<dyn AsComponents>);

impl Property {
    /// The property that an archetype holds.
    pub(crate) fn new<A: Archetype + AsComponents + 'static>(archetype: A) -> Self {
        Self(A::name().short_name(), Box::new(archetype))
    }
}

/// A view to be written.
pub(crate) struct View<'a> {
    /// "3D" or "TimeSeries".
    pub class: &'static str,
    /// The title.
    pub name: String,
    /// The entity whose frame the view takes.
    pub origin: &'a EntityPath,
    /// What the view shows.
    pub contents: &'a [&'a str],
    /// Camera, floor, axes.
    pub properties: Vec<Property>,
}

impl BlueprintStore {
    /// An empty store.
    pub(crate) fn new() -> Result<Self, ViewError> {
        let builder = RecordingStreamBuilder::new(APPLICATION)
            .enabled(true)
            .send_properties(false);
        let (stream, storage) = builder.blueprint().memory()?;
        stream.set_time_sequence(TIMELINE, 0);
        Ok(Self { stream, storage })
    }

    /// Writes a view.
    pub(crate) fn view(&self, view: &View<'_>) -> Result<Part, ViewError> {
        let part = Part::new("view");
        let blueprint = ViewBlueprint::new(view.class)
            .with_display_name(view.name.as_str())
            .with_space_origin(view.origin.to_string());
        self.stream.log(part.path.as_str(), &blueprint)?;
        self.stream.log(
            format!("{}/ViewContents", part.path),
            &ViewContents::new(view.contents.iter().copied()),
        )?;
        for Property(name, archetype) in &view.properties {
            self.stream
                .log(format!("{}/{name}", part.path), archetype.as_ref())?;
        }
        Ok(part)
    }

    /// Writes a container; `shares` are the relative widths or heights of its contents.
    pub(crate) fn container(
        &self,
        kind: ContainerKind,
        name: Option<&str>,
        parts: &[Part],
        shares: &[f32],
    ) -> Result<Part, ViewError> {
        let container = Part::new("container");
        let mut blueprint = ContainerBlueprint::new(kind)
            .with_contents(parts.iter().map(|part| part.path.as_str()));
        if let Some(name) = name {
            blueprint = blueprint.with_display_name(name);
        }
        match kind {
            ContainerKind::Horizontal if !shares.is_empty() => {
                blueprint = blueprint.with_col_shares(shares.iter().copied())
            }
            ContainerKind::Vertical if !shares.is_empty() => {
                blueprint = blueprint.with_row_shares(shares.iter().copied())
            }
            _ => {}
        }
        self.stream.log(container.path.as_str(), &blueprint)?;
        Ok(container)
    }

    /// Writes a container with one tab for each part, and opens the one with this index.
    pub(crate) fn tabs(&self, name: &str, parts: &[Part], open: usize) -> Result<Part, ViewError> {
        let tabs = self.container(ContainerKind::Tabs, Some(name), parts, &[])?;
        if let Some(part) = parts.get(open) {
            self.stream.log(
                tabs.path.as_str(),
                &ContainerBlueprint::update_fields().with_active_tab(part.path.as_str()),
            )?;
        }
        Ok(tabs)
    }

    /// Writes the state of a panel: "blueprint_panel" or "selection_panel".
    pub(crate) fn panel(&self, path: &str, state: PanelState) -> Result<(), ViewError> {
        Ok(self
            .stream
            .log(path, &PanelBlueprint::new().with_state(state))?)
    }

    /// Writes any archetype, for instance the time panel's.
    pub(crate) fn log(&self, path: &str, archetype: &dyn AsComponents) -> Result<(), ViewError> {
        Ok(self.stream.log(path, archetype)?)
    }

    /// Sends the whole store to `recording`, with `root` as the outermost container, and makes it
    /// the layout in use.
    pub(crate) fn send(self, root: &Part, recording: &RecordingStream) -> Result<(), ViewError> {
        let viewport = ViewportBlueprint::new()
            .with_root_container(RootContainer(root.id))
            .with_auto_layout(false)
            .with_auto_views(false);
        self.stream.log("viewport", &viewport)?;
        let messages = self.storage.take();
        if let Some(blueprint_id) = store_id(&messages) {
            recording.send_blueprint(
                messages,
                BlueprintActivationCommand {
                    blueprint_id,
                    make_active: true,
                    make_default: true,
                },
            );
        }
        Ok(())
    }
}

impl Part {
    fn new(kind: &str) -> Self {
        let id = Uuid::random();
        Self {
            id,
            path: format!("{kind}/{id}"),
        }
    }
}

fn store_id(messages: &[LogMsg]) -> Option<StoreId> {
    messages.first().map(|message| message.store_id().clone())
}
