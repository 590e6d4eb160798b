# Print an optspec for argparse to handle cmd's options that are independent of any subcommand.
function __fish_zeroset_global_optspecs
    string join \n q/quiet threads= h/help V/version
end

function __fish_zeroset_needs_command
    # Figure out if the current invocation already has a command.
    set -l cmd (commandline -opc)
    set -e cmd[1]
    argparse -s (__fish_zeroset_global_optspecs) -- $cmd 2>/dev/null
    or return
    if set -q argv[1]
        # Also print the command, so this can be used to figure out what it is.
        echo $argv[1]
        return 1
    end
    return 0
end

function __fish_zeroset_using_subcommand
    set -l cmd (__fish_zeroset_needs_command)
    test -z "$cmd"
    and return 1
    contains -- $cmd[1] $argv
end

complete -c zeroset -n "__fish_zeroset_needs_command" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_needs_command" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_needs_command" -s h -l help -d 'Print help'
complete -c zeroset -n "__fish_zeroset_needs_command" -s V -l version -d 'Print version'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "reconstruct" -d 'Reconstruct a curve or surface from points, closed or open'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "eval" -d 'Evaluate a saved spline at points: value, gradient, Hessian'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "mesh" -d 'Extract the curve or surface of a saved spline again: at another resolution, or another value of the function'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "field" -d 'Sample a saved spline on a grid'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "render" -d 'Draw a saved spline: a surface with points, or a plane function\'s levels with its curve and points'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "info" -d 'Say what is in a points file or a saved spline'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "completions" -d 'Print completions of this command line for a shell'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "man" -d 'Print the manual page, or write those of all commands into a folder'
complete -c zeroset -n "__fish_zeroset_needs_command" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l format -d 'The format of the points, whatever the extension; needed for standard input [example: xyz]' -r -f -a "ply\t''
xyz\t''
xy\t''
txt\t''
csv\t''
asc\t''
pts\t''
obj\t''
stl\t''
npy\t''
las\t''
laz\t''
e57\t''"
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l normals -d 'What to do with normals that the points have: nothing, begin with them, or let them decide the sides. Which way is out is found in any case' -r -f -a "ignore\t'As if there were none'
hint\t'The search begins with them, and ends there if winding numbers agree; wrong ones are put right'
trust\t'They decide which side of the surface each point is seen from, right or wrong'"
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l box -d 'Take only the points in this box: X0,Y0,Z0,X1,Y1,Z1, in the plane X0,Y0,X1,Y1, in the unit of the points [default: all points] [example: -1,-1,0,1,1,2]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l plane -d 'Take two of the three coordinates: the points seen along the third axis, whose outline is wanted [default: all three]' -r -f -a "xy\t'x and y'
xz\t'x and z'
yz\t'y and z'"
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -s o -l output -d 'Where to write, repeatable; the extension decides what: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D), spline .npz, field .npy .exr .vti, picture .png: the surface with points from the front, obliquely and from above, or the function\'s levels with curve and points (also as preview.svg) [example: surface.ply]' -r -F
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l oriented -d 'Write the input points with outward normals, confidence and which are outliers (.ply) [example: normals.ply]' -r -F
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l up -d 'The axis that points up in pictures' -r -f -a "y\t'As in most models: seen from the front, z points at the viewer'
z\t'As in most maps and machines: seen from the front, y points away'"
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l report -d 'Write the report, repeatable: stages, figures, topology of the result as .json, or as an .html page with pictures, plots and a view of the surface that can be turned [example: report.html]' -r -F
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l resolution -d 'Cells along the longest side of the points\' bounding box on the finest level, 8 to 1024 [default: from the spacing of the points] [example: 256]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l smooth -d 'Smooth away detail below this length, in the unit of the points: twice the noise, and less than half of the thinnest wall [default: automatic] [example: 0.5]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l robust -d 'Take weight from points that lie farther off than their neighbours by about this length, in the unit of the points [default: automatic, where the noise has heavy tails] [example: 0.2]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l margin -d 'Room around the points in which the function is defined, at least, in the unit of the points; up to half their longest side [default: a few cells] [example: 10]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l degree -d 'Degree of the B-splines, 2 to 5 [example: 2]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l topology -d 'How inside is told from outside' -r -f -a "continuation\t'Eigenvector, then continuation in the exponent p'
paper\t'The paper\'s section 3 as written'"
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l distance -d 'How the distance on the lattice is computed' -r -f -a "closest-point\t'Sweeping that carries the nearest sample'
godunov\t'The paper\'s Godunov scheme'
exact\t'A search per node'"
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l memory -d 'Memory to use at most: bytes, or with K, M, G or T (powers of 1024). Where more would be needed cells are coarser, with a warning [default: 70 % of what is free] [example: 4G]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l time -d 'Wall-clock time for the whole run at most, in seconds: a run that is not done by then ends with exit code 6 and writes nothing more; files that it had finished stay [default: no limit] [example: 60]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l open -d 'Leave open what the points leave open: the result ends where they do, within about two of their spacings, and holes larger than that stay [default: everything is closed]'
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l no-refine -d 'Stop at the initial shape: no dynamic reconstruction'
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -l accept-doubt -d 'Write the outputs even where no trustworthy surface was found, and end with exit code 0'
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_using_subcommand reconstruct" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c zeroset -n "__fish_zeroset_using_subcommand eval" -l format -d 'The format of the points, whatever the extension; needed for standard input [example: xyz]' -r -f -a "ply\t''
xyz\t''
xy\t''
txt\t''
csv\t''
asc\t''
pts\t''
obj\t''
stl\t''
npy\t''
las\t''
laz\t''
e57\t''"
complete -c zeroset -n "__fish_zeroset_using_subcommand eval" -l memory -d 'Memory to use at most for that: bytes, or with K, M, G or T (powers of 1024) [default: 70 % of what is free] [example: 4G]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand eval" -s o -l output -d 'Where to write: .csv or .npy, one row per point [example: values.csv]' -r -F
complete -c zeroset -n "__fish_zeroset_using_subcommand eval" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand eval" -l distance -d 'Add the signed distance from the curve or surface, in the unit of the points: right at any distance, and outside the function\'s box too. It takes the time of an extraction'
complete -c zeroset -n "__fish_zeroset_using_subcommand eval" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_using_subcommand eval" -s h -l help -d 'Print help'
complete -c zeroset -n "__fish_zeroset_using_subcommand mesh" -s o -l output -d 'Where to write, repeatable: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D) [example: fine.ply]' -r -F
complete -c zeroset -n "__fish_zeroset_using_subcommand mesh" -l resolution -d 'At least this many cells along the longest side of the function\'s box, 2 to 4096, and more where its own cells are smaller. Time and memory grow with the square [default: 96] [example: 512]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand mesh" -l memory -d 'Memory to use at most: bytes, or with K, M, G or T (powers of 1024) [default: 70 % of what is free] [example: 4G]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand mesh" -l iso -d 'Extract f = VALUE in place of f = 0, in the unit of the points: positive values lie outside, negative inside. Near the surface f is close to the distance from it, so that small values give offset surfaces; farther away it is not a distance [example: 0.5]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand mesh" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand mesh" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_using_subcommand mesh" -s h -l help -d 'Print help'
complete -c zeroset -n "__fish_zeroset_using_subcommand field" -s o -l output -d 'Where to write, repeatable: .npy .npz .exr .vti [example: field.vti]' -r -F
complete -c zeroset -n "__fish_zeroset_using_subcommand field" -l spacing -d 'Distance between neighbouring nodes, in the unit of the points [default: as --cells says] [example: 0.1]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand field" -l cells -d 'Cells along the longest side of the function\'s box [default: the function\'s own finest ones, at most 512] [example: 256]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand field" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand field" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_using_subcommand field" -s h -l help -d 'Print help'
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -s o -l output -d 'Where to write, repeatable: .png, in 2D also .svg [example: view.png]' -r -F
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -l points -d 'Points to be drawn too: a points file of the same dimension, or - for standard input. Of more than 20000 some [default: none] [example: scan.ply]' -r -F
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -l format -d 'The format of the points, whatever the extension; needed for standard input [example: xyz]' -r -f -a "ply\t''
xyz\t''
xy\t''
txt\t''
csv\t''
asc\t''
pts\t''
obj\t''
stl\t''
npy\t''
las\t''
laz\t''
e57\t''"
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -l view -d 'From which direction a surface is seen: from the surface towards the viewer [default: from the front, the right and above] [example: 1,0.5,1]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -l up -d 'The axis that points up in the picture of a surface' -r -f -a "y\t'As in most models: seen from the front, z points at the viewer'
z\t'As in most maps and machines: seen from the front, y points away'"
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -l size -d 'Pixels of the picture; that of a plane function has its shape, and is as large as there is room [example: 1200x900]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -l iso -d 'Draw f = VALUE in place of f = 0, in the unit of the points [example: 0.5]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_using_subcommand render" -s h -l help -d 'Print help (see more with \'--help\')'
complete -c zeroset -n "__fish_zeroset_using_subcommand info" -l format -d 'The format of the points, whatever the extension; needed for standard input [example: xyz]' -r -f -a "ply\t''
xyz\t''
xy\t''
txt\t''
csv\t''
asc\t''
pts\t''
obj\t''
stl\t''
npy\t''
las\t''
laz\t''
e57\t''"
complete -c zeroset -n "__fish_zeroset_using_subcommand info" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand info" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_using_subcommand info" -s h -l help -d 'Print help'
complete -c zeroset -n "__fish_zeroset_using_subcommand completions" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand completions" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_using_subcommand completions" -s h -l help -d 'Print help'
complete -c zeroset -n "__fish_zeroset_using_subcommand man" -l threads -d 'Number of threads; the result does not depend on it [default: all cores] [example: 4]' -r
complete -c zeroset -n "__fish_zeroset_using_subcommand man" -s q -l quiet -d 'Print nothing but errors'
complete -c zeroset -n "__fish_zeroset_using_subcommand man" -s h -l help -d 'Print help'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "reconstruct" -d 'Reconstruct a curve or surface from points, closed or open'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "eval" -d 'Evaluate a saved spline at points: value, gradient, Hessian'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "mesh" -d 'Extract the curve or surface of a saved spline again: at another resolution, or another value of the function'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "field" -d 'Sample a saved spline on a grid'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "render" -d 'Draw a saved spline: a surface with points, or a plane function\'s levels with its curve and points'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "info" -d 'Say what is in a points file or a saved spline'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "completions" -d 'Print completions of this command line for a shell'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "man" -d 'Print the manual page, or write those of all commands into a folder'
complete -c zeroset -n "__fish_zeroset_using_subcommand help; and not __fish_seen_subcommand_from reconstruct eval mesh field render info completions man help" -f -a "help" -d 'Print this message or the help of the given subcommand(s)'
