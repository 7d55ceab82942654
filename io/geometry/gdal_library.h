/// \file GDAL's C functions, from its library, which is loaded when the first file needs it: a run
/// without maps does not wait for the libraries that it brings.
#pragma once

#include <cpl_conv.h>
#include <cpl_error.h>
#include <gdal.h>
#include <gdal_frmts.h>
#include <gdal_utils.h>
#include <ogr_api.h>
#include <ogr_srs_api.h>

#include <memory>
#include <string>

#include "io/geometry/map_files.h"

extern "C" {
void RegisterOGRGeoJSON();  // of ogrsf_frmts.h, which is for its C++ classes
void RegisterOGRShape();
}

// clang-format off
#define LAHAR_GDAL_FUNCTIONS(F)                                                                   \
  F(GDALRegister_GTiff) F(GDALRegister_AAIGrid) F(GDALRegister_VRT) F(GDALDeregisterDriver)       \
  F(RegisterOGRGeoJSON) F(RegisterOGRShape) F(CPLSetConfigOption) F(GDALGetBlockSize) F(GDALSetCacheMax64) F(GDALOpenEx) F(GDALReleaseDataset)                            \
  F(GDALGetRasterCount) F(GDALGetRasterBand) F(GDALGetRasterXSize) F(GDALGetRasterYSize)          \
  F(GDALGetGeoTransform) F(GDALGetSpatialRef) F(GDALGetRasterNoDataValue) F(GDALGetMaskFlags)     \
  F(GDALGetMaskBand) F(GDALRasterIOEx) F(GDALGetRasterUnitType) F(GDALGetRasterScale)             \
  F(GDALGetRasterOffset) F(GDALBuildVRT) F(GDALBuildVRTOptionsNew) F(GDALBuildVRTOptionsFree)     \
  F(GDALTranslate) F(GDALTranslateOptionsNew) F(GDALTranslateOptionsFree)                         \
  F(GDALDatasetGetLayerCount) F(GDALDatasetGetLayer) F(OGR_L_GetSpatialRef) F(OGR_L_GetName)      \
  F(OGR_L_SetAttributeFilter) F(OGR_L_ResetReading) F(OGR_L_GetNextFeature) F(OGR_F_Destroy)      \
  F(OGR_F_GetFID) F(OGR_F_GetGeometryRef) F(OGR_G_GetGeometryType) F(OGR_G_GetGeometryName)       \
  F(OGR_G_GetGeometryCount) F(OGR_G_GetGeometryRef) F(OGR_G_GetLinearGeometry)                    \
  F(OGR_G_DestroyGeometry) F(OGR_G_IsValid) F(OGR_G_GetPointCount) F(OGR_G_GetX) F(OGR_G_GetY)    \
  F(OGR_G_IsEmpty) F(OGR_GT_Flatten) F(OSRNewSpatialReference) F(OSRDestroySpatialReference) F(OSRExportToWkt)      \
  F(OSRIsGeographic) F(OSRGetLinearUnits) F(OSRGetName) F(OSRIsSame) F(OSRDemoteTo2D)             \
  F(OSRClone) F(CPLPushErrorHandler) F(CPLPopErrorHandler) F(CPLQuietErrorHandler)                \
  F(CPLGetLastErrorMsg) F(CPLErrorReset) F(VSIFree) F(GDALGetDriverByName) F(GDALCreate)          \
  F(GDALSetGeoTransform) F(GDALSetProjection) F(GDALSetRasterNoDataValue)
// clang-format on

namespace lahar {

struct Gdal {
#define LAHAR_GDAL_POINTER(name) decltype(&::name) name = nullptr;
  LAHAR_GDAL_FUNCTIONS(LAHAR_GDAL_POINTER)
#undef LAHAR_GDAL_POINTER
};

/// Loads the library at the first call. Throws InputError if there is none.
const Gdal& gdal();

/// While it lives, GDAL says nothing on the terminal; its last message is kept for ours.
class QuietGdal {
 public:
  QuietGdal() {
    gdal().CPLPushErrorHandler(gdal().CPLQuietErrorHandler);
    gdal().CPLErrorReset();
  }
  ~QuietGdal() { gdal().CPLPopErrorHandler(); }
  QuietGdal(const QuietGdal&) = delete;
  QuietGdal& operator=(const QuietGdal&) = delete;
  /// What was said last, on one line.
  static std::string said();
};

struct CloseDataset {
  void operator()(void* dataset) const { gdal().GDALReleaseDataset(dataset); }
};
using Dataset = std::unique_ptr<void, CloseDataset>;

/// Opens a map of the formats that Lahar reads, and of no other; null if it is none, or damaged.
/// Throws InputError if what GDAL would read beside it may have no end.
Dataset open_raster(const MapFile& file);
Dataset open_polygons(const MapFile& file);

/// WKT of the plane part of a coordinate reference system; empty for null. Throws InputError if its
/// coordinates are no metres.
std::string plane_reference(OGRSpatialReferenceH reference, const std::string& file);

}  // namespace lahar
