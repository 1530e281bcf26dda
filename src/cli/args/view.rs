//! Arguments of `blinn view`.

use clap::{Arg, Args};

use super::option_args::{OptionArgs, PictureGroup};
use super::preview::PreviewProcessArgs;
use super::process::CommonArgs;
use super::scene::SceneArgs;
use super::time::TimeArgs;
use super::values::{self, BaseUrl};

/// Options of pictures that the page does not have. They are accepted for a message that says where they belong.
const NOT_OF_VIEW: [&str; 3] = ["aov", "depth-unit", "crop"];

#[derive(Debug, Args)]
#[command(mut_args(hide_not_of_view))]
pub struct ViewArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub server: ServerArgs,
    #[command(flatten)]
    pub options: OptionArgs<PictureGroup>,
    #[command(flatten)]
    pub time: TimeArgs,
    #[command(flatten)]
    pub process: PreviewProcessArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// The address of the page.
#[derive(Debug, Args)]
#[command(next_help_heading = "Page")]
pub struct ServerArgs {
    /// Port on the loopback interface, for ssh -L [default: a free one]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub port: Option<u16>,
    /// Address under which a proxy shows the page, such as https://hub.example.org/user/ada/proxy/8080/ of JupyterHub
    ///
    /// Its host is accepted as by --allow-host, and its path with or without being removed by the proxy.
    #[arg(long, value_name = "URL", value_parser = values::base_url)]
    pub base_url: Option<BaseUrl>,
    /// Accept requests for another host, as behind the port forwarding of GitHub Codespaces
    #[arg(long, value_name = "HOST", value_parser = values::host_name)]
    pub allow_host: Vec<String>,
    /// Open the page in the browser
    #[arg(long)]
    pub open: bool,
    /// Print the address as JSON
    #[arg(long)]
    pub json: bool,
}

fn hide_not_of_view(arg: Arg) -> Arg {
    let is_hidden = arg.is_hide_set() || NOT_OF_VIEW.contains(&arg.get_id().as_str());
    arg.hide(is_hidden)
}
