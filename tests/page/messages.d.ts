// Written by tools/write_page_types.py.
declare namespace Viewer {
  interface Size {
    width: number;
    height: number;
  }
  interface Hello {
    width: number;
    height: number;
  }
  interface Acknowledge {
    slices?: boolean;
  }
  interface Camera {
    camera: CameraState;
  }
  interface CameraState {
    eye: number[];
    target: number[];
    up: number[];
    projection: "perspective" | "orthographic";
    field_of_view: number;
    height: number;
  }
  interface Look {
    view: string;
  }
  interface Change {
    changes: Partial<ViewState>;
  }
  interface ChangeObject {
    id: number;
    changes: Partial<ObjectState>;
  }
  interface AddObject {
    source: string;
    level?: number | null;
  }
  interface RemoveObject {
    id: number;
  }
  interface Close {
    source: string;
  }
  interface Undo {
  }
  interface Redo {
  }
  interface Sample {
    volume: string;
    index: number[];
  }
  interface SliceViews {
    views: SliceView[];
  }
  interface SliceView {
    lower: number[];
    upper: number[];
    points: number;
  }
  interface Pick {
    x: number;
    y: number;
    tool?: "point" | "distance" | "angle" | "thickness";
  }
  interface RemoveMeasurement {
    id: number;
  }
  interface ClearMeasurements {
  }
  interface Save {
    what: "png" | "exr" | "turntable" | "mesh" | "session" | "python" | "measurements";
    options?: Record<string, any>;
  }
  interface Restore {
    sources: NamedSource[];
    state: ViewState;
  }
  interface NamedSource {
    key: string;
    name: string;
  }
  interface ViewState {
    objects: ObjectState[];
    light: "studio" | "phong" | "outline" | "ambient-occlusion" | "path-trace";
    shadows: boolean;
    exponent: number;
    background: string;
    clip: ClipState;
    slices: SliceState;
    camera: CameraState | null;
    measurements: Measurement[];
  }
  interface ObjectState {
    id: number;
    source: string;
    level: number | null;
    largest: number | null;
    closed: boolean;
    body_level: number | null;
    color: string;
    opacity: number;
    silhouette_opacity: number | null;
    visible: boolean;
    color_by: string;
    cmap: "viridis" | "magma" | "coolwarm" | "turbo" | "gray" | "cividis" | "plasma" | "RdBu";
    limits: number[] | null;
    metallic: number;
    roughness: number;
  }
  interface ClipState {
    kind: "none" | "plane" | "box";
    point: number[];
    normal: number[];
    minimum: number[];
    maximum: number[];
    capped: boolean;
    values: boolean;
  }
  interface SliceState {
    shown: boolean;
    volume: string | null;
    index: number[];
    window: number[] | null;
  }
  interface Measurement {
    id: number;
    tool: "point" | "distance" | "angle" | "thickness";
    points: MeasuredPoint[];
  }
  interface MeasuredPoint {
    object: number;
    position: number[];
    normal: number[];
    index: number[] | null;
    value: number | null;
    mean_curvature: number | null;
    gaussian_curvature: number | null;
    thickness: number | null;
  }
  interface Upload {
    files: UploadedFile[];
  }
  interface UploadedFile {
    name: string;
    size: number;
  }
  interface OpenRaw {
    number: number;
    options?: RawOptions | null;
  }
  interface RawOptions {
    shape: number[];
    dtype: string;
    offset: number;
    spacing: number[];
  }
  interface State {
    input: number;
    state: ViewState;
    default_limits: Record<number, number[] | null>;
    results: (number | null)[];
    history: Steps;
  }
  interface Steps {
    undo: boolean;
    redo: boolean;
  }
  interface Document {
    sources: SourceAbout[];
  }
  interface SourceAbout {
    key: string;
    name: string;
    kind: string;
    bounds: number[][];
    faces: number | null;
    range: number[] | null;
    suggested_levels: number[];
    level_range: number[] | null;
    spacing_of_values: number;
    histogram: number[];
    counts: number[];
    affine: number[][];
    window: number[] | null;
    patient: boolean;
    unit: string;
    body_level: number | null;
    has_rule: boolean;
  }
  interface CameraMoved {
    camera: CameraState;
  }
  interface Options {
    run: string;
    color_maps: Record<string, string[]>;
    color_rules: string[];
  }
  interface SamePicture {
    before: number;
    input: number;
  }
  interface Error {
    text: string;
  }
  interface Progress {
    title: string | null;
    fraction: number;
  }
  interface Measured {
    point: MeasuredPoint | null;
  }
  interface Sampled {
    index: number[];
    value: number;
  }
  interface Raw {
    number: number;
    name: string;
    size: number;
    shape: number[] | null;
    dtype: string | null;
  }
  interface Uploaded {
  }
  interface Frame {
    input: number;
    size: number[];
    camera: CameraState;
    format: string;
    samples: number;
    final: boolean;
    objects: number;
    scales: number[];
    milliseconds: number[];
  }
  interface SliceValues {
    volume: string;
    index: number[];
    regions: number[][][];
    shapes: number[][];
  }
  interface File {
    name: string;
  }
  type FromPage =
    | ({type: "size"; input?: number} & Size)
    | ({type: "hello"; input?: number} & Hello)
    | ({type: "acknowledge"; input?: number} & Acknowledge)
    | ({type: "camera"; input?: number} & Camera)
    | ({type: "look"; input?: number} & Look)
    | ({type: "change"; input?: number} & Change)
    | ({type: "change_object"; input?: number} & ChangeObject)
    | ({type: "add_object"; input?: number} & AddObject)
    | ({type: "remove_object"; input?: number} & RemoveObject)
    | ({type: "close"; input?: number} & Close)
    | ({type: "undo"; input?: number} & Undo)
    | ({type: "redo"; input?: number} & Redo)
    | ({type: "sample"; input?: number} & Sample)
    | ({type: "slice_views"; input?: number} & SliceViews)
    | ({type: "pick"; input?: number} & Pick)
    | ({type: "remove_measurement"; input?: number} & RemoveMeasurement)
    | ({type: "clear_measurements"; input?: number} & ClearMeasurements)
    | ({type: "save"; input?: number} & Save)
    | ({type: "restore"; input?: number} & Restore)
    | ({type: "upload"; input?: number} & Upload)
    | ({type: "open_raw"; input?: number} & OpenRaw);
  type ToPage =
    | ({type: "state"} & State)
    | ({type: "document"} & Document)
    | ({type: "camera_moved"} & CameraMoved)
    | ({type: "options"} & Options)
    | ({type: "same_picture"} & SamePicture)
    | ({type: "error"} & Error)
    | ({type: "progress"} & Progress)
    | ({type: "measured"} & Measured)
    | ({type: "sampled"} & Sampled)
    | ({type: "raw"} & Raw)
    | ({type: "uploaded"} & Uploaded)
    | ({type: "frame"} & Frame)
    | ({type: "slice_values"} & SliceValues)
    | ({type: "file"} & File);
}
