// All of isospline.
#pragma once

#include "isospline/io/exr.h"
#include "isospline/render/camera.h"
#include "isospline/render/image.h"
#include "isospline/render/renderer.h"
#include "isospline/scene/mesh.h"
#include "isospline/scene/scene.h"
#include "isospline/shade/light.h"
#include "isospline/shade/outline.h"
#include "isospline/shade/phong.h"
#include "isospline/shell/isosurface.h"
#include "isospline/spline/volume.h"
#include "isospline/trace/hit.h"
#include "isospline/trace/hopper.h"
#include "isospline/util/error.h"
#include "isospline/util/parallel.h"
#include "isospline/util/progress.h"
