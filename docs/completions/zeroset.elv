
use builtin;
use str;

set edit:completion:arg-completer[zeroset] = {|@words|
    fn spaces {|n|
        builtin:repeat $n ' ' | str:join ''
    }
    fn cand {|text desc|
        edit:complex-candidate $text &display=$text' '(spaces (- 14 (wcswidth $text)))$desc
    }
    var command = 'zeroset'
    for word $words[1..-1] {
        if (str:has-prefix $word '-') {
            break
        }
        set command = $command';'$word
    }
    var completions = [
        &'zeroset'= {
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help'
            cand --help 'Print help'
            cand -V 'Print version'
            cand --version 'Print version'
            cand reconstruct 'Reconstruct a curve or surface from points, closed or open'
            cand eval 'Evaluate a saved spline at points: value, gradient, Hessian'
            cand mesh 'Extract the curve or surface of a saved spline again: at another resolution, or another value of the function'
            cand field 'Sample a saved spline on a grid'
            cand render 'Draw a saved spline: a surface with points, or a plane function''s levels with its curve and points'
            cand info 'Say what is in a points file or a saved spline'
            cand completions 'Print completions of this command line for a shell'
            cand man 'Print the manual page, or write those of all commands into a folder'
            cand help 'Print this message or the help of the given subcommand(s)'
        }
        &'zeroset;reconstruct'= {
            cand --format 'The format of the points, whatever the extension; needed for standard input [example: xyz]'
            cand --normals 'What to do with normals that the points have: nothing, begin with them, or let them decide the sides. Which way is out is found in any case'
            cand --box 'Take only the points in this box: X0,Y0,Z0,X1,Y1,Z1, in the plane X0,Y0,X1,Y1, in the unit of the points [default: all points] [example: -1,-1,0,1,1,2]'
            cand --plane 'Take two of the three coordinates: the points seen along the third axis, whose outline is wanted [default: all three]'
            cand -o 'Where to write, repeatable; the extension decides what: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D), spline .npz, field .npy .exr .vti, picture .png: the surface with points from the front, obliquely and from above, or the function''s levels with curve and points (also as preview.svg) [example: surface.ply]'
            cand --output 'Where to write, repeatable; the extension decides what: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D), spline .npz, field .npy .exr .vti, picture .png: the surface with points from the front, obliquely and from above, or the function''s levels with curve and points (also as preview.svg) [example: surface.ply]'
            cand --oriented 'Write the input points with outward normals, confidence and which are outliers (.ply) [example: normals.ply]'
            cand --up 'The axis that points up in pictures'
            cand --report 'Write the report, repeatable: stages, figures, topology of the result as .json, or as an .html page with pictures, plots and a view of the surface that can be turned [example: report.html]'
            cand --resolution 'Cells along the longest side of the points'' bounding box on the finest level, 8 to 1024 [default: from the spacing of the points] [example: 256]'
            cand --smooth 'Smooth away detail below this length, in the unit of the points: twice the noise, and less than half of the thinnest wall [default: automatic] [example: 0.5]'
            cand --robust 'Take weight from points that lie farther off than their neighbours by about this length, in the unit of the points [default: automatic, where the noise has heavy tails] [example: 0.2]'
            cand --margin 'Room around the points in which the function is defined, at least, in the unit of the points; up to half their longest side [default: a few cells] [example: 10]'
            cand --degree 'Degree of the B-splines, 2 to 5 [example: 2]'
            cand --topology 'How inside is told from outside'
            cand --distance 'How the distance on the lattice is computed'
            cand --memory 'Memory to use at most: bytes, or with K, M, G or T (powers of 1024). Where more would be needed cells are coarser, with a warning [default: 70 % of what is free] [example: 4G]'
            cand --time 'Wall-clock time for the whole run at most, in seconds: a run that is not done by then ends with exit code 6 and writes nothing more; files that it had finished stay [default: no limit] [example: 60]'
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand --open 'Leave open what the points leave open: the result ends where they do, within about two of their spacings, and holes larger than that stay [default: everything is closed]'
            cand --no-refine 'Stop at the initial shape: no dynamic reconstruction'
            cand --accept-doubt 'Write the outputs even where no trustworthy surface was found, and end with exit code 0'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'zeroset;eval'= {
            cand --format 'The format of the points, whatever the extension; needed for standard input [example: xyz]'
            cand --memory 'Memory to use at most for that: bytes, or with K, M, G or T (powers of 1024) [default: 70 % of what is free] [example: 4G]'
            cand -o 'Where to write: .csv or .npy, one row per point [example: values.csv]'
            cand --output 'Where to write: .csv or .npy, one row per point [example: values.csv]'
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand --distance 'Add the signed distance from the curve or surface, in the unit of the points: right at any distance, and outside the function''s box too. It takes the time of an extraction'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help'
            cand --help 'Print help'
        }
        &'zeroset;mesh'= {
            cand -o 'Where to write, repeatable: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D) [example: fine.ply]'
            cand --output 'Where to write, repeatable: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D) [example: fine.ply]'
            cand --resolution 'At least this many cells along the longest side of the function''s box, 2 to 4096, and more where its own cells are smaller. Time and memory grow with the square [default: 96] [example: 512]'
            cand --memory 'Memory to use at most: bytes, or with K, M, G or T (powers of 1024) [default: 70 % of what is free] [example: 4G]'
            cand --iso 'Extract f = VALUE in place of f = 0, in the unit of the points: positive values lie outside, negative inside. Near the surface f is close to the distance from it, so that small values give offset surfaces; farther away it is not a distance [example: 0.5]'
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help'
            cand --help 'Print help'
        }
        &'zeroset;field'= {
            cand -o 'Where to write, repeatable: .npy .npz .exr .vti [example: field.vti]'
            cand --output 'Where to write, repeatable: .npy .npz .exr .vti [example: field.vti]'
            cand --spacing 'Distance between neighbouring nodes, in the unit of the points [default: as --cells says] [example: 0.1]'
            cand --cells 'Cells along the longest side of the function''s box [default: the function''s own finest ones, at most 512] [example: 256]'
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help'
            cand --help 'Print help'
        }
        &'zeroset;render'= {
            cand -o 'Where to write, repeatable: .png, in 2D also .svg [example: view.png]'
            cand --output 'Where to write, repeatable: .png, in 2D also .svg [example: view.png]'
            cand --points 'Points to be drawn too: a points file of the same dimension, or - for standard input. Of more than 20000 some [default: none] [example: scan.ply]'
            cand --format 'The format of the points, whatever the extension; needed for standard input [example: xyz]'
            cand --view 'From which direction a surface is seen: from the surface towards the viewer [default: from the front, the right and above] [example: 1,0.5,1]'
            cand --up 'The axis that points up in the picture of a surface'
            cand --size 'Pixels of the picture; that of a plane function has its shape, and is as large as there is room [example: 1200x900]'
            cand --iso 'Draw f = VALUE in place of f = 0, in the unit of the points [example: 0.5]'
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help (see more with ''--help'')'
            cand --help 'Print help (see more with ''--help'')'
        }
        &'zeroset;info'= {
            cand --format 'The format of the points, whatever the extension; needed for standard input [example: xyz]'
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help'
            cand --help 'Print help'
        }
        &'zeroset;completions'= {
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help'
            cand --help 'Print help'
        }
        &'zeroset;man'= {
            cand --threads 'Number of threads; the result does not depend on it [default: all cores] [example: 4]'
            cand -q 'Print nothing but errors'
            cand --quiet 'Print nothing but errors'
            cand -h 'Print help'
            cand --help 'Print help'
        }
        &'zeroset;help'= {
            cand reconstruct 'Reconstruct a curve or surface from points, closed or open'
            cand eval 'Evaluate a saved spline at points: value, gradient, Hessian'
            cand mesh 'Extract the curve or surface of a saved spline again: at another resolution, or another value of the function'
            cand field 'Sample a saved spline on a grid'
            cand render 'Draw a saved spline: a surface with points, or a plane function''s levels with its curve and points'
            cand info 'Say what is in a points file or a saved spline'
            cand completions 'Print completions of this command line for a shell'
            cand man 'Print the manual page, or write those of all commands into a folder'
            cand help 'Print this message or the help of the given subcommand(s)'
        }
        &'zeroset;help;reconstruct'= {
        }
        &'zeroset;help;eval'= {
        }
        &'zeroset;help;mesh'= {
        }
        &'zeroset;help;field'= {
        }
        &'zeroset;help;render'= {
        }
        &'zeroset;help;info'= {
        }
        &'zeroset;help;completions'= {
        }
        &'zeroset;help;man'= {
        }
        &'zeroset;help;help'= {
        }
    ]
    $completions[$command]
}
