#!/usr/bin/env python3
"""python formats.py ZEROSET OUTPUTS

Has the program ZEROSET write every format into the folder OUTPUTS and opens each with somebody else's package: counts, bounds, areas
and volumes must be those that zeroset reports. Then has these packages write points, and zeroset say where they are. A check whose package is missing is skipped, and says so; any difference ends in exit
code 1. Tolerances are those of the formats: doubles are exact, 32-bit floats have 24 bits."""
import importlib
import json
import pathlib
import subprocess
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
ZEROSET, OUT = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
SINGLE = 2.0**-23
CHECKS = []


def check(*packages):
    def keep(function):
        CHECKS.append((packages, function))
        return function

    return keep


def zeroset(*arguments):
    done = subprocess.run([ZEROSET, "--quiet", *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, f"zeroset {' '.join(map(str, arguments))}: {done.stderr}"
    return done.stdout


def outputs(stem, extensions):
    return [argument for extension in extensions.split() for argument in ("-o", OUT / f"{stem}.{extension}")]


def make():
    """The outputs: a surface; the same far from the origin with colours, where formats of 32 bits are hard put to it; an open surface; a
    curve; an open path."""
    OUT.mkdir(parents=True, exist_ok=True)
    points = ROOT / "fixtures" / "points"
    zeroset("reconstruct", points / "double_torus.ply", "--resolution", 32, *outputs("ring", "ply obj stl glb npz exr vti npy"),
            "--oriented", OUT / "ring_oriented.ply", "--report", OUT / "ring.json", "--report", OUT / "ring.html")
    far = sphere() + [5e6, 4e5, 100]
    colours = np.where(far[:, 2:] > 100, [250, 20, 0], [0, 20, 250])
    np.savetxt(OUT / "far.csv", np.hstack([far, colours]), delimiter=",", header="x,y,z,red,green,blue", comments="",
               fmt=["%.6f"] * 3 + ["%d"] * 3)
    zeroset("reconstruct", OUT / "far.csv", "--resolution", 12, *outputs("far", "ply obj stl glb"), "--report", OUT / "far.json")
    zeroset("reconstruct", points / "bowl.ply", "--open", "--resolution", 24, *outputs("bowl", "ply obj stl glb"),
            "--report", OUT / "bowl.json", "--report", OUT / "bowl.html")
    zeroset("reconstruct", points / "annulus_offset.xy", *outputs("annulus", "svg csv dxf npz exr vti npy"),
            "-o", OUT / "annulus_curves.json",
            "--report", OUT / "annulus.json", "--report", OUT / "annulus.html")
    arc = 0.05 * np.arange(60)
    np.savetxt(OUT / "arc.xy", np.stack([np.cos(arc), np.sin(arc)], axis=-1))
    zeroset("reconstruct", OUT / "arc.xy", "--open", *outputs("arc", "svg dxf"), "-o", OUT / "arc_curves.json")
    zeroset("render", OUT / "annulus.npz", "--points", points / "annulus_offset.xy", "-o", OUT / "annulus_levels.svg")
    for name in ["ring", "annulus"]:
        zeroset("field", OUT / f"{name}.npz", "--cells", 64, *outputs(f"{name}_field", "npy npz exr vti"))


def told(name):
    """What zeroset says of its own result."""
    return json.loads((OUT / f"{name}.json").read_text())["stages"][-1]


def close(found, expected, tolerance, what):
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    assert found.shape == expected.shape, f"{what}: {found.shape} instead of {expected.shape}"
    worst = np.abs(found - expected).max()
    # Not a number is not below either.
    assert worst <= tolerance, f"{what}: {worst:g} off, more than {tolerance:g}"


def same_mesh(name, vertices, triangles, shift=0.0, rounding=0.0):
    """Against the report, and the doubles of the .ply read by NumPy alone. `rounding` is how far a coordinate may be off."""
    expected = told(name)
    assert len(vertices) == expected["vertices"], f"{len(vertices)} vertices instead of {expected['vertices']}"
    assert len(triangles) == expected["triangles"], f"{len(triangles)} triangles instead of {expected['triangles']}"
    corners = np.asarray(vertices, float) + shift
    own = ply_vertices(OUT / f"{name}.ply")
    tolerance = rounding + 1e-15 * np.abs(own).max()
    close([corners.min(0), corners.max(0)], [own.min(0), own.max(0)], tolerance, "bounds")
    middle = own.mean(0)
    a, b, c = (corners[np.asarray(triangles)[:, k]] - middle for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    size = np.ptp(own, axis=0).max()
    # Every vertex may be off by the rounding: so may the surface as a whole, and each triangle's sides.
    close(area, expected["area"], expected["area"] * (1e-9 + 1e3 * tolerance / size), "area")
    if expected["topology"]["closed"]:
        volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
        close(volume, expected["volume"], 1e-9 * size**3 + 2 * expected["area"] * tolerance, "volume")
    return f"{len(vertices)} vertices, {len(triangles)} triangles, area {area:.6g}"


def ply_vertices(path):
    data = path.read_bytes()
    header, _, body = data.partition(b"end_header\n")
    types = {"double": "<f8", "float": "<f4", "uchar": "u1", "int": "<i4"}
    lines = [line.split() for line in header.decode().splitlines()]
    count = next(int(words[2]) for words in lines if words[:2] == ["element", "vertex"])
    fields = [(words[2], types[words[1]]) for words in lines if words[0] == "property" and words[1] != "list"]
    table = np.frombuffer(body, np.dtype(fields), count)
    return np.stack([table[axis] for axis in "xyz"], axis=-1)


MESHES = [("ring", 0.0), ("far", 5e6), ("bowl", 0.0)]


@check("trimesh")
def meshes_by_trimesh(trimesh):
    for name, far in MESHES:
        for extension in ["ply", "obj", "glb", "stl"]:
            scene = trimesh.load_scene(OUT / f"{name}.{extension}", process=False, maintain_order=True)
            mesh = scene.to_geometry() if extension == "glb" else next(iter(scene.geometry.values()))
            vertices, faces, rounding = mesh.vertices, mesh.faces, 0.0
            size = np.ptp(ply_vertices(OUT / f"{name}.ply"), axis=0).max()
            if extension == "glb":
                # Relative to the node's translation, which is added in doubles.
                rounding = SINGLE * size
            if extension == "stl":
                # Corners alone: whoever reads them merges the equal ones.
                vertices, inverse = np.unique(np.asarray(vertices), axis=0, return_inverse=True)
                faces = inverse.reshape(-1)[np.asarray(faces)]
                # An ascii file with all decimals where 32 bits do not reach.
                rounding = 0.0 if far else SINGLE * np.abs(vertices).max()
            said = same_mesh(name, vertices, faces, rounding=rounding)
            closed = told(name)["topology"]["closed"]
            whole = trimesh.Trimesh(vertices, faces, process=False)
            assert whole.is_watertight == closed, "watertight?"
            assert whole.is_winding_consistent, "triangles turned over"
            assert whole.euler_number == told(name)["topology"]["euler_characteristic"], whole.euler_number
            if extension != "stl":
                normals = np.einsum("ij,ij->i", mesh.vertex_normals, trimesh.Trimesh(vertices - vertices.mean(0), faces, process=False).vertex_normals)
                assert (normals > 0.5).all(), f"normals: {normals.min()}"
            if name == "far" and extension in ["ply", "glb"]:
                top = mesh.vertices[:, 2] > np.median(mesh.vertices[:, 2])
                # With a material, as every .glb has one, trimesh keeps colours as an attribute.
                colours = mesh.visual.vertex_colors if extension == "ply" else next(iter(scene.geometry.values())).visual.vertex_attributes["color"]
                red = colours[:, 0] > colours[:, 2]
                assert (red == top).mean() > 0.9, "colours"
            yield f"{name}.{extension}: {said}"


@check("pymeshlab")
def meshes_by_meshlab(pymeshlab):
    for name, far in MESHES:
        for extension in ["ply", "obj", "glb"] if far else ["ply", "obj", "stl", "glb"]:
            meshes = pymeshlab.MeshSet()
            meshes.load_new_mesh(str(OUT / f"{name}.{extension}"))
            if extension == "stl":
                meshes.meshing_remove_duplicate_vertices()
            mesh = meshes.current_mesh()
            # A .glb file's translation is beside the vertices.
            matrix = mesh.transform_matrix()
            vertices = mesh.vertex_matrix() @ matrix[:3, :3].T + matrix[:3, 3]
            own = ply_vertices(OUT / f"{name}.ply")
            # MeshLab reads an .stl, ascii or not, and a translation in 32-bit floats.
            rounding = 1e-12 * np.abs(own).max()
            if extension in ["stl", "glb"]:
                rounding = SINGLE * np.abs(own).max()
            said = same_mesh(name, vertices, mesh.face_matrix(), rounding=rounding)
            figures, topology = meshes.get_topological_measures(), told(name)["topology"]
            assert figures["connected_components_number"] == topology["components"], figures
            assert figures["number_holes"] == topology["boundary_loops"], figures
            assert figures["non_two_manifold_edges"] == 0, figures
            if topology["closed"]:
                assert figures["genus"] == topology["genus"], figures
            yield f"{name}.{extension}: {said}, {figures['number_holes']} holes"


def lattice(name):
    saved = np.load(OUT / f"{name}_field.npz")
    close(np.load(OUT / f"{name}_field.npy"), saved["values"], 0, ".npy")
    return saved["values"], saved["origin"], saved["spacing"]


@check("OpenEXR")
def fields_by_openexr(OpenEXR):
    for name in ["ring", "annulus"]:
        values, origin, spacing = lattice(name)
        file = OpenEXR.File(str(OUT / f"{name}_field.exr"))
        layers = [part.channels["Y"].pixels for part in file.parts]
        # As docs/formats.md has it.
        stacked = np.stack([layer[::-1].T for layer in layers], axis=-1).reshape(values.shape)
        close(stacked, values.astype(np.float32), 0, "values")
        names = [part.name() for part in file.parts]
        assert names == (["f"] if name == "annulus" else [f"z{k:04}" for k in range(len(layers))]), names
        header = file.parts[0].header
        for key, expected in [("origin", origin), ("spacing", spacing)]:
            close([float(number) for number in header[key].split()], expected, 0, key)
        yield f"{name}_field.exr: {len(layers)} layers of {layers[0].shape}"


@check("pyvista")
def fields_by_pyvista(pyvista):
    for name in ["ring", "annulus"]:
        values, origin, spacing = lattice(name)
        grid = pyvista.read(OUT / f"{name}_field.vti")
        dimension = values.ndim
        close(grid.dimensions[:dimension], values.shape, 0, "dimensions")
        close(grid.origin[:dimension], origin, 0, "origin")
        close(grid.spacing[:dimension], spacing, 0, "spacing")
        close(grid["f"].reshape(values.shape, order="F"), values, 0, "values")
        sure = pyvista.read(OUT / f"{name}.vti")
        close(np.abs(sure["confidence"] - 0.5).max() <= 0.5, True, 0, "confidence between 0 and 1")
        # A node in a few is beside the points of a thin part.
        close(np.median(sure["confidence"]), 1.0, 0.01, "confidence in the median")
        said = f"{name}_field.vti: {grid.n_points} nodes"
        if name == "ring":
            # VTK's own contours of the field enclose about what zeroset's mesh does: to a twentieth on cells this coarse.
            volume = grid.contour([0.0], scalars="f").volume
            close(volume, told(name)["volume"], 0.05 * told(name)["volume"], "volume")
            said += f", contour of volume {volume:.5g} (mesh: {told(name)['volume']:.5g})"
        yield said


@check("scipy")
def splines_by_scipy(_):
    sys.path.insert(0, str(ROOT / "fixtures"))
    import check_npz

    for name in ["ring", "annulus"]:
        saved = dict(np.load(OUT / f"{name}.npz"))
        vertices = ply_vertices(OUT / "ring.ply") if name == "ring" else curves(name)
        # Near the zero set, where all levels act.
        queries = vertices[::7] + 0.01 * np.sin(1e3 * vertices[::7])
        np.save(OUT / "queries.npy", queries)
        zeroset("eval", OUT / f"{name}.npz", OUT / "queries.npy", "-o", OUT / "values.npy")
        table = np.load(OUT / "values.npy")
        dimension = queries.shape[1]
        values = check_npz.evaluate(saved, queries, [0] * dimension)
        # Rounding beside the largest coefficient.
        close(values, table[:, dimension], 1e-12 * np.abs(saved["coefficients"]).max(), "values")
        yield f"{name}.npz: {len(queries)} values, {int(saved.get('levels', 0))} levels"


@check("trimesh", "rtree")
def distances_by_trimesh(trimesh, _):
    mesh = trimesh.load(OUT / "ring.ply", process=False)
    low, high = mesh.bounds
    # In the box and beyond it (Roberts' sequence).
    steps = np.array([0.8191725134, 0.6710436067, 0.5497004779])
    queries = low + (high - low) * (1.5 * ((0.5 + np.outer(np.arange(1000), steps)) % 1) - 0.25)
    np.save(OUT / "queries.npy", queries)
    zeroset("eval", OUT / "ring.npz", OUT / "queries.npy", "--distance", "-o", OUT / "distances.npy")
    found = np.load(OUT / "distances.npy")[:, -1]
    # Theirs is positive inside.
    expected = -trimesh.proximity.signed_distance(mesh, queries)
    cell = json.loads((OUT / "ring.json").read_text())["frame"]["cell"]
    close(found, expected, cell, "distances")
    yield f"ring.npz: {len(queries)} signed distances, largest difference {np.abs(found - expected).max() / cell:.2g} cells"


def curves(name):
    found = json.loads((OUT / f"{name}_curves.json").read_text())
    return np.concatenate([np.array(curve) for curve in found["curves"] + found.get("paths", [])])


def shoelace(polygon):
    x, y = (polygon - polygon.mean(0)).T
    return 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()


@check("ezdxf")
def curves_by_ezdxf(ezdxf):
    for name, opens in [("annulus", 0), ("arc", 1)]:
        document = ezdxf.readfile(OUT / f"{name}.dxf")
        errors = document.audit().errors
        assert not errors, errors
        lines = list(document.modelspace().query("POLYLINE"))
        expected = json.loads((OUT / f"{name}_curves.json").read_text())
        loops, paths = [line for line in lines if line.is_closed], [line for line in lines if not line.is_closed]
        assert (len(loops), len(paths)) == (len(expected["curves"]), opens), f"{len(loops)} loops, {len(paths)} paths"
        for line, vertices in zip(loops + paths, expected["curves"] + expected.get("paths", [])):
            close([vertex.dxf.location.xyz[:2] for vertex in line.vertices], vertices, 0, "vertices")
            assert line.dxf.layer == "ZEROSET", line.dxf.layer
        said = f"{name}.dxf: {len(loops)} closed, {len(paths)} open"
        if name == "annulus":
            area = sum(shoelace(np.array([vertex.dxf.location.xyz[:2] for vertex in line.vertices])) for line in loops)
            close(area, told(name)["topology"]["area"], 1e-9 * abs(area), "area")
            said += f", area {area:.6g}"
        yield said


def sphere():
    """800 points spread evenly over the unit sphere, none of them twice, in an order of their own."""
    rows = np.arange(800)
    z = (rows + 0.5) / 400 - 1
    across = np.sqrt(1 - z**2)
    return np.stack([across * np.cos(2.399963 * rows), across * np.sin(2.399963 * rows), z], axis=-1)


def read_back(name, points, rounding, ordered=True):
    """Has zeroset read what another program wrote and say where the points are."""
    again = OUT / "read_back.ply"
    zeroset("reconstruct", OUT / name, "--resolution", 12, "--no-refine", "--accept-doubt", "--oriented", again)
    found = ply_vertices(again)
    if not ordered:
        found, points = (np.unique(np.round(some, 6), axis=0) for some in (found, points))
    close(found, points, rounding, "coordinates")
    return f"{name}: {len(found)} points"


@check("numpy")
def points_by_numpy(_):
    points = sphere()
    arrays = {"double": points, "single": points.astype("f4"), "big_endian": points.astype(">f8"), "by_columns": np.asfortranarray(points)}
    for name, array in arrays.items():
        np.save(OUT / f"{name}.npy", array)
        yield read_back(f"{name}.npy", points, SINGLE if array.itemsize == 4 else 0)
    np.savetxt(OUT / "blanks.xyz", points, fmt="%.17g")
    np.savetxt(OUT / "numbers.asc", points, fmt="%.17g", delimiter="\t", newline="\r\n")
    np.savetxt(OUT / "semicolons.csv", points, fmt="%.17g", delimiter=";")
    columns = np.hstack([np.arange(800)[:, None], points, points])
    np.savetxt(OUT / "header.csv", columns, fmt="%.17g", delimiter=",", header="id,x,y,z,nx,ny,nz", comments="")
    np.savetxt(OUT / "comment.txt", points, fmt="%.17g", header="x y z")
    np.savetxt(OUT / "count.pts", points, fmt="%.17g", header="800", comments="")
    for name in ["blanks.xyz", "numbers.asc", "semicolons.csv", "header.csv", "comment.txt", "count.pts"]:
        yield read_back(name, points, 0)


@check("trimesh")
def points_by_trimesh(trimesh):
    points = sphere()
    cloud = trimesh.PointCloud(points, colors=np.full((800, 4), [9, 99, 199, 255], np.uint8))
    for name, options in {"trimesh.ply": {}, "trimesh_ascii.ply": {"encoding": "ascii"}, "trimesh.xyz": {}}.items():
        cloud.export(OUT / name, **options)
        yield read_back(name, points, 4 * SINGLE)
    ball = trimesh.creation.icosphere(subdivisions=3)
    for name, options in {"ball.obj": {}, "ball.stl": {}, "ball_ascii.stl": {"file_type": "stl_ascii"}}.items():
        ball.export(OUT / name, **options)
        yield read_back(name, ball.vertices, 2e-6, ordered=False)


@check("pymeshlab")
def points_by_meshlab(pymeshlab):
    points = sphere()
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=points, v_normals_matrix=points, v_scalar_array=np.arange(800.0)))
    for name, options in {"meshlab.ply": {}, "meshlab_ascii.ply": {"binary": False}, "meshlab.xyz": {}, "meshlab.obj": {}, "meshlab.e57": {}}.items():
        meshes.save_current_mesh(str(OUT / name), **options)
        # Six decimals in text.
        yield read_back(name, points, 1e-6)


@check("pye57")
def points_by_pye57(pye57):
    points = sphere()
    (OUT / "scans.e57").unlink(missing_ok=True)
    scans = pye57.E57(str(OUT / "scans.e57"), mode="w")
    # The second scan stands elsewhere: its points are written as seen from there.
    for half, away in [(points[:300], np.zeros(3)), (points[300:], np.array([3.0, -2.0, 1.0]))]:
        seen = np.ascontiguousarray((half - away).T)
        columns = dict(zip(["cartesianX", "cartesianY", "cartesianZ"], seen))
        scans.write_scan_raw(columns, rotation=np.array([1.0, 0, 0, 0]), translation=away)
    scans.close()
    yield read_back("scans.e57", points, 4 * SINGLE)


@check("laspy")
def points_by_laspy(laspy):
    points = sphere()
    for extension in ["las", "laz"]:
        header = laspy.LasHeader(point_format=6, version="1.4")
        header.offsets, header.scales = points.min(0), [1e-7] * 3
        data = laspy.LasData(header)
        data.x, data.y, data.z = points.T
        data.write(OUT / f"points.{extension}")
        yield read_back(f"points.{extension}", points, 0.51e-7)


def main():
    make()
    failed = 0
    for packages, function in CHECKS:
        title = function.__name__.replace("_", " ")
        try:
            loaded = [importlib.import_module(package) for package in packages]
        except ImportError as error:
            print(f"skipped  {title}: {error}; checks/setup.sh installs it")
            continue
        try:
            for line in function(*loaded):
                print(f"ok       {title}: {line}")
        except Exception as error:  # whatever another program makes of a broken file
            failed += 1
            print(f"FAILED   {title}: {type(error).__name__}: {error}")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
