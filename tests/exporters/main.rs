//! Files with the structure that exporters write (docs/reference/exporters.md), each with what must be shown of it. Tests of
//! single rules are beside the importers in src/import.
//!
//! - `gltf`: glTF of PyVista, PlayCanvas, loaders.gl, ParaView, FBX2glTF, plot2gltf and luma.gl
//! - `obj`: OBJ and MTL of CloudCompare, OpenCTM, LeoCAD, yt, ursina, Sweet Home 3D, PyMOL, Babylon.js, VTK, PyVista, SolveSpace,
//!   Wings 3D, TopologicPy, OpenSceneGraph, Assimp, p5.js, serialize-wavefront-obj and Ladybug

#[path = "../common/mod.rs"]
mod common;

mod gltf;
mod obj;
