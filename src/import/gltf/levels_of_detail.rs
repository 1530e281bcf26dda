//! Levels of detail (MSFT_lod): of the levels of an object, only the finest is drawn. Exporters keep the nodes of the
//! coarser levels in the scene too.

use std::collections::BTreeSet;

use ::gltf::json::Root;

use super::graph::SceneNode;

/// The place of a node's subtree in the list of nodes, which is in depth-first order.
#[derive(Clone, Copy)]
struct Subtree {
    start: usize,
    end: usize,
}

/// Marks the nodes of coarser levels, and what is below them, as not drawn. `nodes` is in depth-first order.
///
/// The node with the extension is the finest level. If nothing below it has a mesh, the finest is the first level that
/// has one.
pub(super) fn hide_coarser_levels(root: &Root, nodes: &mut [SceneNode]) {
    let levels: Vec<(usize, Vec<usize>)> = nodes
        .iter()
        .enumerate()
        .filter_map(|(i, node)| Some((i, coarser_levels(root, node.node)?)))
        .collect();
    if levels.is_empty() {
        return;
    }
    let subtree_of = subtrees(root, nodes);
    // Meshes at the nodes before each.
    let mut meshes_before = vec![0usize];
    for node in nodes.iter() {
        let has_mesh = usize::from(root.nodes[node.node].mesh.is_some());
        meshes_before.push(meshes_before[meshes_before.len() - 1] + has_mesh);
    }
    let meshes = |subtree: Subtree| meshes_before[subtree.end] - meshes_before[subtree.start];
    let mut finest_places = BTreeSet::new();
    for (place, ids) in levels {
        let Some(finest) = subtree_of[nodes[place].node] else { continue };
        let mut coarser: Vec<Subtree> = ids.iter().filter_map(|&id| *subtree_of.get(id)?).collect();
        // A level is neither the node itself nor above it.
        coarser.retain(|level| !(level.start..level.end).contains(&place));
        // A coarser level may have levels of its own, which are coarser still.
        if !nodes[place].is_drawn {
            coarser.retain(|level| finest_places.range(level.start..level.end).next().is_none());
            coarser.iter().for_each(|level| nodes[level.start].is_drawn = false);
            continue;
        }
        finest_places.insert(place);
        let mut below: Vec<Subtree> = coarser
            .iter()
            .copied()
            .filter(|level| (finest.start..finest.end).contains(&level.start))
            .collect();
        below.sort_by_key(|level| level.start);
        let mut counted = finest.start;
        let mut own = meshes(finest);
        for level in below.into_iter().filter(|level| {
            let is_outermost = level.start >= counted;
            counted = counted.max(level.end);
            is_outermost
        }) {
            own -= meshes(level);
        }
        let instead = if own == 0 { coarser.iter().position(|&level| meshes(level) > 0) } else { None };
        for (i, level) in coarser.iter().enumerate() {
            nodes[level.start].is_drawn &= Some(i) == instead;
        }
    }
    for i in 0..nodes.len() {
        nodes[i].is_drawn &= nodes[i].parent.is_none_or(|parent| nodes[parent as usize].is_drawn);
    }
}

/// Returns the nodes that are coarser levels of a node.
fn coarser_levels(root: &Root, node: usize) -> Option<Vec<usize>> {
    let extensions = root.nodes[node].extensions.as_ref()?;
    let ids = extensions.others.get("MSFT_lod")?.get("ids")?.as_array()?;
    Some(ids.iter().filter_map(|id| usize::try_from(id.as_u64()?).ok()).collect())
}

/// Returns the subtree of each node of the file that is in the scene.
fn subtrees(root: &Root, nodes: &[SceneNode]) -> Vec<Option<Subtree>> {
    let mut sizes = vec![1usize; nodes.len()];
    for (i, node) in nodes.iter().enumerate().rev() {
        if let Some(parent) = node.parent {
            sizes[parent as usize] += sizes[i];
        }
    }
    let mut out = vec![None; root.nodes.len()];
    for (start, node) in nodes.iter().enumerate() {
        out[node.node] = Some(Subtree { start, end: start + sizes[start] });
    }
    out
}
