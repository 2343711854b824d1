//! What a node is started with.

use crate::args::RosArgs;
use crate::discovery::Network;
use crate::error::RosResult;
use crate::names::NodeName;
use crate::parameter::Parameters;
use crate::security::Security;
use crate::shutdown::Shutdown;

/// What a node is started with. Everything is checked before DDS is touched, so `--check-config`
/// needs no more than this.
#[derive(Clone)]
pub struct NodeOptions {
    /// The node's name, after `__node` and `__ns`.
    pub name: NodeName,
    /// Its parameters, files and `-p` applied.
    pub parameters: Parameters,
    /// The domain, and how far the node looks for peers.
    pub network: Network,
    /// How its messages are protected.
    pub security: Security,
    /// What ends it.
    pub shutdown: Shutdown,
    /// The command line, for remaps.
    pub args: RosArgs,
    /// Whether to offer the parameter services.
    pub parameter_services: bool,
}

impl NodeOptions {
    /// A node of this name, unless the command line renames it, with the network from the
    /// environment. Ended by its own [`Shutdown`]; set [`Shutdown::on_signals`] in `main`.
    ///
    /// # Errors
    /// Where a parameter, a name or an environment variable is wrong; one line that names the
    /// place.
    pub fn new(default_name: &str, args: &RosArgs, parameters: &Parameters) -> RosResult<Self> {
        let name = args.node_name(default_name)?;
        parameters.apply(args, &name)?;
        let network = Network::from_env()?;
        let security = Security::from_env(args)?;
        let (parameters, args) = (parameters.clone(), args.clone());
        Ok(Self {
            name,
            parameters,
            network,
            security,
            shutdown: Shutdown::new(),
            args,
            parameter_services: true,
        })
    }

    /// With this shutdown.
    #[must_use]
    pub fn shutdown(mut self, shutdown: &Shutdown) -> Self {
        self.shutdown = shutdown.clone();
        self
    }

    /// In this network.
    #[must_use]
    pub fn network(mut self, network: Network) -> Self {
        self.network = network;
        self
    }
}
