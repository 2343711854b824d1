//! What participants tell each other about their nodes, on the topic `ros_discovery_info`.

use serde::Deserialize;

use crate::raw::Gid;

/// `rmw_dds_common/msg/ParticipantEntitiesInfo` as it is received: which nodes live in a
/// participant, and which endpoints are theirs. Ours for reading: ros2-client's type does not let
/// the endpoints out.
#[derive(Debug, Deserialize)]
pub(crate) struct ParticipantInfo {
    pub(crate) participant: Gid,
    pub(crate) nodes: Vec<NodeInfo>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct NodeInfo {
    pub(crate) namespace: String,
    pub(crate) name: String,
    pub(crate) readers: Vec<Gid>,
    pub(crate) writers: Vec<Gid>,
}
