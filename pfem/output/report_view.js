// the view of a report: frames of a run on a stage that can be turned, with a slider over time; needs three.js and its OrbitControls
(function () {
    'use strict';
    var stage = document.getElementById('stage'), controls = document.getElementById('controls');
    var data = JSON.parse(document.getElementById('view-data').textContent);
    var space = data.dim === 3, present = 0, playing = false, shown = null, hidden = {}, glass = false;
    var ink = {sand: 0xcfae78, sandEdge: 0x6b4f2a, water: 0x8cbfe0, waterEdge: 0x1d4e73, drop: 0x3f7fae, grain: 0xd9a441,
               stone: 0xb9b4ac, stoneEdge: 0x3a3733, wall: 0xe4e6e8, wallEdge: 0x54585c};
    var palette = new Uint8Array(3 * 256);

    function element(kind, parent, text) {
        var made = document.createElement(kind);
        if (text)
            made.textContent = text;
        parent.appendChild(made);
        return made;
    }

    // ---------------------------------------------------------------- numbers

    function bytes(block) {
        var text = atob(data.blocks[block]), out = new Uint8Array(text.length);
        for (var i = 0; i < text.length; i++)
            out[i] = text.charCodeAt(i);
        return out;
    }
    // whole numbers, low byte first
    function whole(block, width) {
        var from = bytes(block), n = from.length / width, out = width === 2 ? new Uint16Array(n) : new Uint32Array(n);
        for (var i = 0; i < n; i++)
            for (var k = 0; k < width; k++)
                out[i] += from[width * i + k] * Math.pow(256, k);
        return out;
    }
    function places(block) {
        var from = whole(block, 2), out = new Float32Array(from.length);
        for (var i = 0; i < from.length; i++)
            out[i] = data.lo[i % 3] + data.step * from[i];
        return out;
    }
    function links(part, name) {
        return whole(part[name], part.points <= 65535 ? 2 : 4);
    }
    function colours(block) {
        var from = bytes(block), out = new Uint8Array(3 * from.length);
        for (var i = 0; i < from.length; i++)
            for (var d = 0; d < 3; d++)
                out[3 * i + d] = palette[3 * from[i] + d];
        return new THREE.BufferAttribute(out, 3, true);
    }
    function makePalette() {
        var n = data.map.length - 1;
        for (var i = 0; i < 256; i++) {
            var s = n * i / 255, k = Math.min(Math.floor(s), n - 1);
            var mixed = new THREE.Color(data.map[k]).lerp(new THREE.Color(data.map[k + 1]), s - k);
            palette.set([255 * mixed.r, 255 * mixed.g, 255 * mixed.b], 3 * i);
        }
    }

    // ---------------------------------------------------------------- parts of a frame

    function material(colour, options) {
        var all = {color: colour, side: THREE.DoubleSide};
        for (var key in options)
            all[key] = options[key];
        return space ? new THREE.MeshPhongMaterial(all) : new THREE.MeshBasicMaterial(all);
    }
    function lines(group, place, index, colour, lift) {
        var geometry = new THREE.BufferGeometry();
        geometry.setAttribute('position', place);
        if (index)
            geometry.setIndex(new THREE.BufferAttribute(index, 1));
        var made = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: colour}));
        made.position.z = lift;
        group.add(made);
    }
    function faces(group, geometry, index, paint, smooth, lift) {
        geometry.setIndex(new THREE.BufferAttribute(index, 1));
        if (smooth)
            geometry.computeVertexNormals();
        var made = new THREE.Mesh(geometry, paint);
        made.position.z = lift;
        group.add(made);
    }
    // in the plane one part lies over the other
    function lift(level) {
        return space ? 0 : level * 1e-4 * 65535 * data.step;
    }

    function solid(part, plain, edge, level, options) {
        var group = new THREE.Group(), place = new THREE.BufferAttribute(places(part.x), 3), paint = {};
        part.points = place.count;
        for (var key in options)
            paint[key] = options[key];
        var tinted = part.c !== undefined, colour = tinted ? colours(part.c) : null, index = links(part, 'f');
        if (tinted)
            paint.vertexColors = THREE.VertexColors;
        // a free surface is smooth, what lies on walls is as flat as they are
        var cuts = part.free !== undefined && space ? [[0, 3 * part.free, true], [3 * part.free, index.length, false]]
                                                    : [[0, index.length, false]];
        cuts.forEach(function (cut) {
            var geometry = new THREE.BufferGeometry(), own = {};
            if (cut[0] === cut[1])
                return;
            geometry.setAttribute('position', place);
            if (tinted)
                geometry.setAttribute('color', colour);
            for (var name in paint)
                own[name] = paint[name];
            if (space)
                own.flatShading = !cut[2];
            faces(group, geometry, index.slice(cut[0], cut[1]), material(tinted ? 0xffffff : plain, own), cut[2], lift(level));
        });
        if (part.e !== undefined)
            lines(group, place, links(part, 'e'), edge, lift(level + 0.5));
        return group;
    }

    function water(part) {
        var see = glass ? {transparent: true, opacity: 0.45, depthWrite: false} : {};
        if (space)
            see.shininess = 60, see.specular = 0x444444;
        // where water lies on the bed the bed is seen
        see.polygonOffset = true, see.polygonOffsetFactor = 1, see.polygonOffsetUnits = 1;
        var made = solid(part, ink.water, ink.waterEdge, 0, see);
        if (glass)
            made.renderOrder = 1;
        return made;
    }

    function drops(part) {
        var geometry = new THREE.BufferGeometry();
        geometry.setAttribute('position', new THREE.BufferAttribute(places(part.x), 3));
        return new THREE.Points(geometry, new THREE.PointsMaterial({color: ink.drop, size: 3, sizeAttenuation: false}));
    }

    function grains(part) {
        var place = places(part.x), radius = whole(part.r, 2), n = radius.length, matrix = new THREE.Matrix4();
        var shape = !space ? new THREE.CircleBufferGeometry(1, 20)
                           : n < 5000 ? new THREE.SphereBufferGeometry(1, 14, 10) : new THREE.IcosahedronBufferGeometry(1, 1);
        var made = new THREE.InstancedMesh(shape, material(ink.grain, {}), n);
        for (var i = 0; i < n; i++) {
            var r = radius[i] * data.step / 16;
            matrix.makeScale(r, r, r);
            matrix.setPosition(place[3 * i], place[3 * i + 1], place[3 * i + 2] + lift(3));
            made.setMatrixAt(i, matrix);
        }
        made.frustumCulled = false;
        return made;
    }

    function bodies(part) {
        if (space)
            return solid(part, ink.stone, ink.stoneEdge, 0, {});
        var group = new THREE.Group(), place = places(part.x), corners = whole(part.outline, 2), first = 0;
        corners.forEach(function (n) {
            var points = [];
            for (var i = first; i < first + n; i++)
                points.push(new THREE.Vector2(place[3 * i], place[3 * i + 1]));
            first += n;
            var made = new THREE.Mesh(new THREE.ShapeBufferGeometry(new THREE.Shape(points)), material(ink.stone, {}));
            made.position.z = lift(5);
            group.add(made);
            var around = new THREE.LineLoop(new THREE.BufferGeometry().setFromPoints(points),
                                            new THREE.LineBasicMaterial({color: ink.stoneEdge}));
            around.position.z = lift(6);
            group.add(around);
        });
        return group;
    }

    function walls(part) {
        var group = new THREE.Group();
        if (part.x !== undefined) {
            var geometry = new THREE.BufferGeometry();
            geometry.setAttribute('position', new THREE.BufferAttribute(places(part.x), 3));
            geometry.computeVertexNormals();
            // only faces that the eye sees from the water's side, so that one looks into the tank
            group.add(new THREE.Mesh(geometry, material(ink.wall, {side: THREE.FrontSide, polygonOffset: true, polygonOffsetFactor: 2,
                                                                   polygonOffsetUnits: 2})));
        }
        lines(group, new THREE.BufferAttribute(places(part.e), 3), null, ink.wallEdge, lift(8));
        return group;
    }

    function bed(part) {
        return solid(part, ink.sand, ink.sandEdge, 1, {});
    }

    var makers = {water: water, drops: drops, bed: bed, grains: grains, bodies: bodies, walls: walls};

    // ---------------------------------------------------------------- stage

    var renderer;
    try {
        renderer = new THREE.WebGLRenderer({antialias: true});
    } catch (reason) {
        element('p', stage, 'This browser shows no WebGL, so there is no view to turn; the pictures are below.');
        return;
    }
    makePalette();
    stage.appendChild(renderer.domElement);
    renderer.setPixelRatio(window.devicePixelRatio || 1);
    var scene = new THREE.Scene(), lo = new THREE.Vector3().fromArray(data.room[0]), hi = new THREE.Vector3().fromArray(data.room[1]);
    var middle = lo.clone().add(hi).multiplyScalar(0.5), size = hi.clone().sub(lo), reach = size.length();
    scene.background = new THREE.Color(0xf7f8f9);
    var sky = new THREE.HemisphereLight(0xffffff, 0xb4b8bd, 0.85);
    sky.position.set(0, 0, 1);
    scene.add(sky);
    var sun = new THREE.DirectionalLight(0xffffff, 0.3);
    sun.position.set(0.25, -0.45, 0.9);
    scene.add(sun);
    var camera = space ? new THREE.PerspectiveCamera(32, 1, 0.01 * reach, 20 * reach) : new THREE.OrthographicCamera(-1, 1, 1, -1, 0.1, 10);
    var hand = new THREE.OrbitControls(camera, renderer.domElement);

    function draw() {
        renderer.render(scene, camera);
    }
    function resize() {
        var wide = stage.clientWidth, shape = space ? 0.5 : (size.y + 0.04 * size.x) / (1.04 * size.x);
        var high = Math.round(Math.max(220, Math.min(wide * shape, 640)));
        renderer.setSize(wide, high);
        if (space)
            camera.aspect = wide / high;
        else {
            var half = 0.52 * Math.max(size.x / wide, size.y / high);
            camera.left = -half * wide, camera.right = half * wide, camera.top = half * high, camera.bottom = -half * high;
        }
        camera.updateProjectionMatrix();
        draw();
    }
    function fit() {
        hand.target.copy(middle);
        camera.zoom = 1;
        if (space) {
            camera.up.set(0, 0, 1);
            // from the front, the right and above, as the pictures are; so far off that the room's corners are seen
            var back = new THREE.Vector3(0.42, -0.79, 0.44), right = new THREE.Vector3(0, 0, 1).cross(back).normalize();
            var up = back.clone().cross(right), half = Math.tan(0.5 * camera.fov * Math.PI / 180), far = 0, k;
            for (k = 0; k < 8; k++) {
                var at = new THREE.Vector3(k & 1 ? size.x : -size.x, k & 2 ? size.y : -size.y, k & 4 ? size.z : -size.z).multiplyScalar(0.5);
                far = Math.max(far, at.dot(back) + Math.max(Math.abs(at.dot(up)) / half, Math.abs(at.dot(right)) / (half * camera.aspect)));
            }
            camera.position.copy(middle).addScaledVector(back, 1.03 * far);
        } else
            camera.position.set(middle.x, middle.y, 5);
        camera.updateProjectionMatrix();
        hand.update();
        draw();
    }

    // ---------------------------------------------------------------- controls

    function show(frame) {
        present = frame;
        if (shown) {
            scene.remove(shown);
            shown.traverse(function (part) {
                if (part.geometry)
                    part.geometry.dispose();
                if (part.material)
                    part.material.dispose();
            });
        }
        shown = new THREE.Group();
        Object.keys(makers).forEach(function (name) {
            if (data.frames[frame][name] && !hidden[name === 'drops' ? 'water' : name])
                shown.add(makers[name](data.frames[frame][name]));
        });
        scene.add(shown);
        slider.value = frame;
        clock.textContent = 't = ' + data.frames[frame].t.toPrecision(4) + ' s';
        draw();
    }

    var bar = element('div', controls), play = element('button', bar, 'play'), slider = element('input', bar), clock = element('output', bar);
    slider.type = 'range';
    slider.min = 0;
    slider.max = data.frames.length - 1;
    slider.setAttribute('aria-label', 'time');
    slider.addEventListener('input', function () {
        show(Number(slider.value));
    });
    // a run lasts six seconds at the least
    var pace = Math.max(40, 6000 / data.frames.length), due = 0;
    function tick(now) {
        if (!playing)
            return;
        if (now >= due) {
            due = now + pace;
            show((present + 1) % data.frames.length);
        }
        window.requestAnimationFrame(tick);
    }
    play.addEventListener('click', function () {
        playing = !playing;
        play.textContent = playing ? 'stop' : 'play';
        window.requestAnimationFrame(tick);
    });

    var parts = element('div', controls);
    function tickBox(text, on, change) {
        var label = element('label', parts), box = element('input', label);
        box.type = 'checkbox';
        box.checked = on;
        label.appendChild(document.createTextNode(' ' + text));
        box.addEventListener('change', function () {
            change(box.checked);
            show(present);
        });
    }
    ['water', 'bed', 'grains', 'bodies', 'walls'].forEach(function (name) {
        if (data.frames.some(function (frame) { return frame[name]; }))
            tickBox(name, true, function (on) { hidden[name] = !on; });
    });
    if (space && data.frames.some(function (frame) { return frame.water; }))
        tickBox('see through the water', false, function (on) { glass = on; });
    element('button', parts, 'whole view').addEventListener('click', fit);
    var coloured = data.frames.some(function (frame) {
        return ['water', 'bed'].some(function (name) { return frame[name] && frame[name].c !== undefined; });
    });
    if (data.label && coloured) {
        var scale = element('span', parts);
        scale.className = 'scale';
        element('span', scale, data.low.toPrecision(3));
        element('i', scale).style.background = 'linear-gradient(to right,' + data.map.join(',') + ')';
        element('span', scale, data.high.toPrecision(3) + '  ' + data.label);
    }

    if (!space) {
        hand.enableRotate = false;
        hand.screenSpacePanning = true;
        hand.mouseButtons = {LEFT: THREE.MOUSE.PAN, MIDDLE: THREE.MOUSE.DOLLY, RIGHT: THREE.MOUSE.PAN};
        hand.touches = {ONE: THREE.TOUCH.PAN, TWO: THREE.TOUCH.DOLLY_PAN};
    }
    hand.addEventListener('change', draw);
    window.addEventListener('resize', resize);
    resize();
    fit();
    // the last frame, or the one at the time that the address tells: report.html#t=2.5
    var asked = /^#t=([-+.\de]+)$/.exec(window.location.hash), first = data.frames.length - 1;
    while (asked && first > 0 && Math.abs(data.frames[first - 1].t - asked[1]) < Math.abs(data.frames[first].t - asked[1]))
        first--;
    show(first);
}());
