
using namespace System.Management.Automation
using namespace System.Management.Automation.Language

Register-ArgumentCompleter -Native -CommandName 'zeroset' -ScriptBlock {
    param($wordToComplete, $commandAst, $cursorPosition)

    $commandElements = $commandAst.CommandElements
    $command = @(
        'zeroset'
        for ($i = 1; $i -lt $commandElements.Count; $i++) {
            $element = $commandElements[$i]
            if ($element -isnot [StringConstantExpressionAst] -or
                $element.StringConstantType -ne [StringConstantType]::BareWord -or
                $element.Value.StartsWith('-') -or
                $element.Value -eq $wordToComplete) {
                break
        }
        $element.Value
    }) -join ';'

    $completions = @(switch ($command) {
        'zeroset' {
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('-V', '-V ', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('--version', '--version', [CompletionResultType]::ParameterName, 'Print version')
            [CompletionResult]::new('reconstruct', 'reconstruct', [CompletionResultType]::ParameterValue, 'Reconstruct a curve or surface from points, closed or open')
            [CompletionResult]::new('eval', 'eval', [CompletionResultType]::ParameterValue, 'Evaluate a saved spline at points: value, gradient, Hessian')
            [CompletionResult]::new('mesh', 'mesh', [CompletionResultType]::ParameterValue, 'Extract the curve or surface of a saved spline again: at another resolution, or another value of the function')
            [CompletionResult]::new('field', 'field', [CompletionResultType]::ParameterValue, 'Sample a saved spline on a grid')
            [CompletionResult]::new('render', 'render', [CompletionResultType]::ParameterValue, 'Draw a saved spline: a surface with points, or a plane function''s levels with its curve and points')
            [CompletionResult]::new('info', 'info', [CompletionResultType]::ParameterValue, 'Say what is in a points file or a saved spline')
            [CompletionResult]::new('completions', 'completions', [CompletionResultType]::ParameterValue, 'Print completions of this command line for a shell')
            [CompletionResult]::new('man', 'man', [CompletionResultType]::ParameterValue, 'Print the manual page, or write those of all commands into a folder')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'zeroset;reconstruct' {
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'The format of the points, whatever the extension; needed for standard input [example: xyz]')
            [CompletionResult]::new('--normals', '--normals', [CompletionResultType]::ParameterName, 'What to do with normals that the points have: nothing, begin with them, or let them decide the sides. Which way is out is found in any case')
            [CompletionResult]::new('--box', '--box', [CompletionResultType]::ParameterName, 'Take only the points in this box: X0,Y0,Z0,X1,Y1,Z1, in the plane X0,Y0,X1,Y1, in the unit of the points [default: all points] [example: -1,-1,0,1,1,2]')
            [CompletionResult]::new('--plane', '--plane', [CompletionResultType]::ParameterName, 'Take two of the three coordinates: the points seen along the third axis, whose outline is wanted [default: all three]')
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'Where to write, repeatable; the extension decides what: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D), spline .npz, field .npy .exr .vti, picture .png: the surface with points from the front, obliquely and from above, or the function''s levels with curve and points (also as preview.svg) [example: surface.ply]')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Where to write, repeatable; the extension decides what: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D), spline .npz, field .npy .exr .vti, picture .png: the surface with points from the front, obliquely and from above, or the function''s levels with curve and points (also as preview.svg) [example: surface.ply]')
            [CompletionResult]::new('--oriented', '--oriented', [CompletionResultType]::ParameterName, 'Write the input points with outward normals, confidence and which are outliers (.ply) [example: normals.ply]')
            [CompletionResult]::new('--up', '--up', [CompletionResultType]::ParameterName, 'The axis that points up in pictures')
            [CompletionResult]::new('--report', '--report', [CompletionResultType]::ParameterName, 'Write the report, repeatable: stages, figures, topology of the result as .json, or as an .html page with pictures, plots and a view of the surface that can be turned [example: report.html]')
            [CompletionResult]::new('--resolution', '--resolution', [CompletionResultType]::ParameterName, 'Cells along the longest side of the points'' bounding box on the finest level, 8 to 1024 [default: from the spacing of the points] [example: 256]')
            [CompletionResult]::new('--smooth', '--smooth', [CompletionResultType]::ParameterName, 'Smooth away detail below this length, in the unit of the points: twice the noise, and less than half of the thinnest wall [default: automatic] [example: 0.5]')
            [CompletionResult]::new('--robust', '--robust', [CompletionResultType]::ParameterName, 'Take weight from points that lie farther off than their neighbours by about this length, in the unit of the points [default: automatic, where the noise has heavy tails] [example: 0.2]')
            [CompletionResult]::new('--margin', '--margin', [CompletionResultType]::ParameterName, 'Room around the points in which the function is defined, at least, in the unit of the points; up to half their longest side [default: a few cells] [example: 10]')
            [CompletionResult]::new('--degree', '--degree', [CompletionResultType]::ParameterName, 'Degree of the B-splines, 2 to 5 [example: 2]')
            [CompletionResult]::new('--topology', '--topology', [CompletionResultType]::ParameterName, 'How inside is told from outside')
            [CompletionResult]::new('--distance', '--distance', [CompletionResultType]::ParameterName, 'How the distance on the lattice is computed')
            [CompletionResult]::new('--memory', '--memory', [CompletionResultType]::ParameterName, 'Memory to use at most: bytes, or with K, M, G or T (powers of 1024). Where more would be needed cells are coarser, with a warning [default: 70 % of what is free] [example: 4G]')
            [CompletionResult]::new('--time', '--time', [CompletionResultType]::ParameterName, 'Wall-clock time for the whole run at most, in seconds: a run that is not done by then ends with exit code 6 and writes nothing more; files that it had finished stay [default: no limit] [example: 60]')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('--open', '--open', [CompletionResultType]::ParameterName, 'Leave open what the points leave open: the result ends where they do, within about two of their spacings, and holes larger than that stay [default: everything is closed]')
            [CompletionResult]::new('--no-refine', '--no-refine', [CompletionResultType]::ParameterName, 'Stop at the initial shape: no dynamic reconstruction')
            [CompletionResult]::new('--accept-doubt', '--accept-doubt', [CompletionResultType]::ParameterName, 'Write the outputs even where no trustworthy surface was found, and end with exit code 0')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'zeroset;eval' {
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'The format of the points, whatever the extension; needed for standard input [example: xyz]')
            [CompletionResult]::new('--memory', '--memory', [CompletionResultType]::ParameterName, 'Memory to use at most for that: bytes, or with K, M, G or T (powers of 1024) [default: 70 % of what is free] [example: 4G]')
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'Where to write: .csv or .npy, one row per point [example: values.csv]')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Where to write: .csv or .npy, one row per point [example: values.csv]')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('--distance', '--distance', [CompletionResultType]::ParameterName, 'Add the signed distance from the curve or surface, in the unit of the points: right at any distance, and outside the function''s box too. It takes the time of an extraction')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'zeroset;mesh' {
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'Where to write, repeatable: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D) [example: fine.ply]')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Where to write, repeatable: mesh .ply .obj .stl .glb (3D), curve .svg .json .csv .dxf (2D) [example: fine.ply]')
            [CompletionResult]::new('--resolution', '--resolution', [CompletionResultType]::ParameterName, 'At least this many cells along the longest side of the function''s box, 2 to 4096, and more where its own cells are smaller. Time and memory grow with the square [default: 96] [example: 512]')
            [CompletionResult]::new('--memory', '--memory', [CompletionResultType]::ParameterName, 'Memory to use at most: bytes, or with K, M, G or T (powers of 1024) [default: 70 % of what is free] [example: 4G]')
            [CompletionResult]::new('--iso', '--iso', [CompletionResultType]::ParameterName, 'Extract f = VALUE in place of f = 0, in the unit of the points: positive values lie outside, negative inside. Near the surface f is close to the distance from it, so that small values give offset surfaces; farther away it is not a distance [example: 0.5]')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'zeroset;field' {
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'Where to write, repeatable: .npy .npz .exr .vti [example: field.vti]')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Where to write, repeatable: .npy .npz .exr .vti [example: field.vti]')
            [CompletionResult]::new('--spacing', '--spacing', [CompletionResultType]::ParameterName, 'Distance between neighbouring nodes, in the unit of the points [default: as --cells says] [example: 0.1]')
            [CompletionResult]::new('--cells', '--cells', [CompletionResultType]::ParameterName, 'Cells along the longest side of the function''s box [default: the function''s own finest ones, at most 512] [example: 256]')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'zeroset;render' {
            [CompletionResult]::new('-o', '-o', [CompletionResultType]::ParameterName, 'Where to write, repeatable: .png, in 2D also .svg [example: view.png]')
            [CompletionResult]::new('--output', '--output', [CompletionResultType]::ParameterName, 'Where to write, repeatable: .png, in 2D also .svg [example: view.png]')
            [CompletionResult]::new('--points', '--points', [CompletionResultType]::ParameterName, 'Points to be drawn too: a points file of the same dimension, or - for standard input. Of more than 20000 some [default: none] [example: scan.ply]')
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'The format of the points, whatever the extension; needed for standard input [example: xyz]')
            [CompletionResult]::new('--view', '--view', [CompletionResultType]::ParameterName, 'From which direction a surface is seen: from the surface towards the viewer [default: from the front, the right and above] [example: 1,0.5,1]')
            [CompletionResult]::new('--up', '--up', [CompletionResultType]::ParameterName, 'The axis that points up in the picture of a surface')
            [CompletionResult]::new('--size', '--size', [CompletionResultType]::ParameterName, 'Pixels of the picture; that of a plane function has its shape, and is as large as there is room [example: 1200x900]')
            [CompletionResult]::new('--iso', '--iso', [CompletionResultType]::ParameterName, 'Draw f = VALUE in place of f = 0, in the unit of the points [example: 0.5]')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help (see more with ''--help'')')
            break
        }
        'zeroset;info' {
            [CompletionResult]::new('--format', '--format', [CompletionResultType]::ParameterName, 'The format of the points, whatever the extension; needed for standard input [example: xyz]')
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'zeroset;completions' {
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'zeroset;man' {
            [CompletionResult]::new('--threads', '--threads', [CompletionResultType]::ParameterName, 'Number of threads; the result does not depend on it [default: all cores] [example: 4]')
            [CompletionResult]::new('-q', '-q', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('--quiet', '--quiet', [CompletionResultType]::ParameterName, 'Print nothing but errors')
            [CompletionResult]::new('-h', '-h', [CompletionResultType]::ParameterName, 'Print help')
            [CompletionResult]::new('--help', '--help', [CompletionResultType]::ParameterName, 'Print help')
            break
        }
        'zeroset;help' {
            [CompletionResult]::new('reconstruct', 'reconstruct', [CompletionResultType]::ParameterValue, 'Reconstruct a curve or surface from points, closed or open')
            [CompletionResult]::new('eval', 'eval', [CompletionResultType]::ParameterValue, 'Evaluate a saved spline at points: value, gradient, Hessian')
            [CompletionResult]::new('mesh', 'mesh', [CompletionResultType]::ParameterValue, 'Extract the curve or surface of a saved spline again: at another resolution, or another value of the function')
            [CompletionResult]::new('field', 'field', [CompletionResultType]::ParameterValue, 'Sample a saved spline on a grid')
            [CompletionResult]::new('render', 'render', [CompletionResultType]::ParameterValue, 'Draw a saved spline: a surface with points, or a plane function''s levels with its curve and points')
            [CompletionResult]::new('info', 'info', [CompletionResultType]::ParameterValue, 'Say what is in a points file or a saved spline')
            [CompletionResult]::new('completions', 'completions', [CompletionResultType]::ParameterValue, 'Print completions of this command line for a shell')
            [CompletionResult]::new('man', 'man', [CompletionResultType]::ParameterValue, 'Print the manual page, or write those of all commands into a folder')
            [CompletionResult]::new('help', 'help', [CompletionResultType]::ParameterValue, 'Print this message or the help of the given subcommand(s)')
            break
        }
        'zeroset;help;reconstruct' {
            break
        }
        'zeroset;help;eval' {
            break
        }
        'zeroset;help;mesh' {
            break
        }
        'zeroset;help;field' {
            break
        }
        'zeroset;help;render' {
            break
        }
        'zeroset;help;info' {
            break
        }
        'zeroset;help;completions' {
            break
        }
        'zeroset;help;man' {
            break
        }
        'zeroset;help;help' {
            break
        }
    })

    $completions.Where{ $_.CompletionText -like "$wordToComplete*" } |
        Sort-Object -Property ListItemText
}
