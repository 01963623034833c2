"""The Python code that makes the picture of a state."""

from __future__ import annotations

from typing import Any

from ..color_rules import ColorByValue
from ..colors import CURVATURES
from .picture import FINAL_SAMPLES, LAMP, LAMP_RIGHT, LAMP_UP, SKY, default_limits


def script(document, state, size, path="picture.png", background=None):
    """A program that renders a state with a camera, exactly like the viewer's last pass.

    The background is that of the state, or another one. Comments say what is in memory alone.
    """
    background = state.background if background is None else background
    lines = ["import math", "", "import isospline", ""] if state.light == "path-trace" else ["import isospline", ""]
    visible = [each for each in state.objects if each.is_seen]
    used = {each.source for each in visible} | {each.color_by for each in visible}
    for source in document:
        if source.key in used:
            expression = source.expression(state.camera.camera(), size) or f"...  # {source.name}, from memory"
            lines.append(f"{source.key} = {expression}")
            if lost := source.only_in_memory(state):
                lines.append(f"# Its surface was given with {', '.join(lost)}, which this program does not have.")
    lines += ["", "scene = isospline.Scene()"]
    names = [f"object{each.id}" for each in visible]
    lines += [f"{name} = scene.add({_object(document, state, each)})" for name, each in zip(names, visible)]
    lines += ["", f"camera = {_camera(state.camera)}"]
    rows = [f"\n    {name}: {_look(document, state, each)}," for name, each in zip(names, visible)]
    looks = "{" + "".join(rows) + ("\n}" if rows else "}")
    if state.light == "path-trace":
        lines += [
            "right, up, forward = camera.world_to_camera[:3, :3]",
            "lights = [",
            f"    isospline.EnvironmentLight({SKY}),",
            "    isospline.DirectionalLight(",
            f"        forward + {LAMP_RIGHT} * right + {LAMP_UP} * up, intensity={LAMP} * math.pi",
            "    ),",
            "]",
            f"look = isospline.PathTracer(materials={looks}, lights=lights)",
        ]
    elif state.light == "studio":
        lines.append(f"look = isospline.Studio(materials={looks})")
    else:
        lines.append(f"look = {looks}")
    lines += [
        "image = isospline.render(",
        f"    scene, camera, size={tuple(size)}, light=look, background={background!r},",
        f"    samples={FINAL_SAMPLES[state.light]},",
        ")",
        f"image.write({path!r})",
    ]
    return "\n".join(lines) + "\n"


def _object(document, state, each):
    if each.level is None:
        return each.source
    options = "" if each.largest is None else f", largest={each.largest}"
    if each.body_level is not None:
        options += f", mask={document[each.source].mask_expression(each.body_level)}"
    if each.closed:
        options += ", closed=True"
    if state.clip.kind != "none":
        options += f", clip=[{_cuts(state.clip)}], capped={state.clip.capped}"
    return f"isospline.Isosurface({each.source}, {each.level!r}{options})"


def _cuts(clip):
    if clip.kind == "plane":
        return f"isospline.HalfSpace({clip.point}, {clip.normal})"
    (box,) = clip.cuts()
    return f"isospline.Box({tuple(box.minimum.tolist())}, {tuple(box.maximum.tolist())})"


def _camera(camera):
    place = f"{camera.eye}, {camera.target}, {camera.up}"
    if camera.projection == "orthographic":
        return f"isospline.OrthographicCamera({place}, height={camera.height!r})"
    return f"isospline.PerspectiveCamera({place}, {camera.field_of_view!r})"


def _color(document, each):
    limits = default_limits(each, document)
    if each.color_by == "own" and (rule := document[each.source].rule) is not None:
        return "isospline.ColorByValue()" if rule == ColorByValue() else "..."  # others are in memory alone
    if each.color_by == "normal":
        return "isospline.ColorByNormal()"
    if each.color_by in ("color", "own"):
        return repr(each.color)
    limits = tuple(each.limits or limits)
    if each.color_by in CURVATURES:
        return f"isospline.ColorByCurvature({CURVATURES[each.color_by]!r}, {each.cmap!r}, limits={limits})"
    return f"isospline.ColorByVolume({each.color_by}, {each.cmap!r}, limits={limits})"


def _look(document, state, each):
    color = _color(document, each)
    options: dict[str, Any] = {}
    if state.clip.shows_values and each.level is not None:
        shown, source = state.slices, document[each.source]
        window = shown.window if shown.window and shown.volume == each.source else source.window()
        options["cap_color"] = f'isospline.ColorByVolume({each.source}, "gray", limits={tuple(window)})'
    if state.light == "path-trace":
        options = {"metallic": each.metallic, "roughness": each.roughness, **options}
        return f"isospline.Material({color}{_keywords(options)})"
    if each.opacity < 1:
        options["opacity"] = each.opacity
    if each.silhouette_opacity is not None:
        options["silhouette_opacity"] = each.silhouette_opacity
    if state.light == "studio":
        return f"isospline.Material({color}{_keywords(options)})"
    if state.light == "outline":
        return f"isospline.Outline({state.exponent!r}, surface_color={color}, color=0.02{_keywords(options)})"
    if state.light == "ambient-occlusion":
        return f"isospline.AmbientOcclusion(color={color}{_keywords(options)})"
    if state.shadows:
        options["shadows"] = True
    return f"isospline.Phong(color={color}{_keywords(options)})"


def _keywords(options):
    return "".join(f", {name}={value}" for name, value in options.items())
