use super::*;
use blinn_scene::UvTransform;

mod mikktspace;

/// A rotated map rotates the tangents, except in Blender's files.
#[test]
fn tangents_follow_the_texture_transform_except_in_blender_files() {
    let quarter = UvTransform::khr(Vec2::ZERO, std::f32::consts::FRAC_PI_2, Vec2::ONE);
    let map = TangentAxes { transform: quarter, ..map() };
    for (generator, along) in [("", Vec3::Y), ("Khronos glTF Blender I/O v5.0.21", Vec3::X)] {
        let mut mesh = square();
        generate(&mut mesh, map, &Source { generator: generator.into(), ..Source::default() });
        let t = mesh.tangents[0].truncate();
        assert!(t.dot(along).abs() > 0.999, "{generator}: {t}");
    }
}

fn map() -> TangentAxes {
    TangentAxes { uv_set: 0, transform: UvTransform::IDENTITY }
}

/// A square of two triangles in the plane z = 0 with an upright image.
fn square() -> Mesh {
    Mesh {
        positions: [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0)).into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        normals: vec![Vec3::Z; 4],
        uvs: vec![[(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(|(u, v)| Vec2::new(u, v)).into()],
        ..Mesh::default()
    }
}

#[test]
fn tangents_of_an_upright_image_point_along_u() {
    let mut mesh = square();
    generate(&mut mesh, map(), &Source::default());
    // t points along +u, and b = cross(n, t)·w up in the image.
    assert_eq!(mesh.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
    assert_eq!(mesh.positions.len(), 4);
}

#[test]
fn mirrored_texture_coordinates_split_the_seam() {
    let mut mesh = square();
    // The second triangle is folded back onto the image.
    mesh.uvs[0][3] = Vec2::new(1.0, 1.0);
    mesh.colors = (0..4).map(|i| Vec4::splat(i as f32)).collect();
    generate(&mut mesh, map(), &Source::default());
    assert_eq!((mesh.positions.len(), mesh.tangents.len(), mesh.uvs[0].len()), (6, 6, 6));
    let signs: Vec<[f32; 3]> =
        mesh.triangles.iter().map(|t| t.map(|v| mesh.tangents[v as usize].w)).collect();
    assert_eq!(signs, [[1.0; 3], [-1.0; 3]]);
    for t in &mesh.triangles {
        assert!(t.iter().all(|&v| mesh.positions[v as usize].is_finite()));
    }
    assert_eq!(
        mesh.colors[4],
        mesh.colors[mesh.positions.iter().position(|p| *p == mesh.positions[4]).unwrap()]
    );
}

#[test]
fn invalid_values_do_not_panic() {
    for value in [f32::NAN, f32::INFINITY, 1e38, 0.0] {
        let mut mesh = square();
        mesh.positions[2] = Vec3::splat(value);
        mesh.uvs[0][1] = Vec2::splat(value);
        mesh.normals[0] = Vec3::splat(value);
        generate(&mut mesh, map(), &Source::default());
        assert_eq!(mesh.tangents.len(), mesh.positions.len());
    }
}

/// Meshes with few distinct values, so that vertices, edges and triangles coincide in all ways.
fn degenerate_meshes() -> impl proptest::strategy::Strategy<Value = Mesh> {
    use proptest::prelude::*;
    let number = || prop_oneof![Just(0.0f32), Just(1.0), Just(-1.0), Just(1e-30), Just(1e14)];
    let vertex = (number(), number(), number(), number(), number(), 0..4usize);
    let normals = [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::ZERO];
    (1..12usize).prop_flat_map(move |n| {
        let vertices = prop::collection::vec(vertex.clone(), n);
        let triangles = prop::collection::vec(prop::array::uniform3(0..n as u32), 1..24);
        (vertices, triangles).prop_map(move |(vertices, triangles)| Mesh {
            positions: vertices.iter().map(|v| Vec3::new(v.0, v.1, v.2)).collect(),
            normals: vertices.iter().map(|v| normals[v.5]).collect(),
            uvs: vec![vertices.iter().map(|v| Vec2::new(v.3, v.4)).collect()],
            triangles,
            ..Mesh::default()
        })
    })
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(4000))]
    #[test]
    fn degenerate_meshes_keep_their_shape(mesh in degenerate_meshes()) {
        let mut split = mesh.clone();
        generate(&mut split, map(), &Source::default());
        assert_eq!(split.tangents.len(), split.positions.len());
        assert!(split.tangents.iter().all(|tangent| tangent.is_finite()));
        assert_eq!(split.uvs[0].len(), split.positions.len());
        for (a, b) in mesh.triangles.as_flattened().iter().zip(split.triangles.as_flattened()) {
            let a = *a as usize;
            let b = *b as usize;
            assert_eq!((mesh.positions[a], mesh.normals[a]), (split.positions[b], split.normals[b]));
        }
    }
}

#[test]
fn duplicate_triangles_share_their_tangents() {
    let mut mesh = square();
    mesh.uvs[0][3] = Vec2::new(1.0, 1.0);
    let mut alone = mesh.clone();
    generate(&mut alone, map(), &Source::default());
    mesh.triangles.extend([[1, 2, 0], [3, 0, 2]]);
    generate(&mut mesh, map(), &Source::default());
    assert_eq!((&mesh.positions, &mesh.tangents), (&alone.positions, &alone.tangents));
    let turned: Vec<[u32; 3]> = [mesh.triangles[2], mesh.triangles[3]]
        .iter()
        .zip([2, 1])
        .map(|(t, by)| [t[by], t[(by + 1) % 3], t[(by + 2) % 3]])
        .collect();
    assert_eq!(turned, alone.triangles);
}

#[test]
fn coincident_triangles_take_linear_time() {
    let n = 100_000;
    let start = std::time::Instant::now();
    let mut same = square();
    same.triangles = same.triangles.repeat(n / 2);
    generate(&mut same, map(), &Source::default());
    assert_eq!(same.positions.len(), 4);
    // Triangles at one position with different coordinates; a fan around one vertex; triangles without
    // area.
    for kind in 0..3 {
        let mut mesh = Mesh { uvs: vec![Vec::new()], ..Mesh::default() };
        for i in 0..n as u32 {
            let f = i as f32 * 1e-3;
            let corners = match kind {
                0 => [Vec3::ZERO, Vec3::X, Vec3::Y],
                1 => [Vec3::ZERO, Vec3::new(f, 1.0, 0.0), Vec3::new(f + 1e-3, 1.0, 0.0)],
                _ => [Vec3::ZERO; 3],
            };
            let shift = if kind == 1 { 0.0 } else { f };
            mesh.positions.extend(corners);
            mesh.normals.extend([Vec3::Z; 3]);
            mesh.uvs[0].extend([Vec2::new(shift, 0.0), Vec2::new(shift + 1.0, f), Vec2::new(shift, 1.0)]);
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        generate(&mut mesh, map(), &Source::default());
        assert!(mesh.tangents.iter().all(|t| t.is_finite()));
    }
    // Quadratic time would take minutes.
    assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
}
