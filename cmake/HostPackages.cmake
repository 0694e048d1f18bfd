# What the host and the simulator's pictures need, and the appliance does not.
find_package(TBB REQUIRED)
find_package(Boost 1.74 REQUIRED COMPONENTS context)
find_package(SQLite3 REQUIRED)
find_package(Ceres REQUIRED)
find_package(NLopt REQUIRED)
find_package(embree 3 REQUIRED)
find_package(assimp REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs calib3d video aruco)
find_package(ZLIB REQUIRED)
pkg_check_modules(epoxy REQUIRED IMPORTED_TARGET epoxy)
find_package(glfw3 3.3 REQUIRED)
pkg_check_modules(xcb REQUIRED IMPORTED_TARGET xcb)
pkg_check_modules(seccomp REQUIRED IMPORTED_TARGET libseccomp)
pkg_check_modules(imgui REQUIRED IMPORTED_TARGET imgui)
find_package(ITK 5.2 REQUIRED COMPONENTS
  ITKCommon ITKIOImageBase ITKIOGDCM ITKIONIFTI ITKIONRRD ITKIOMeta
  ITKConnectedComponents ITKDisplacementField ITKDistanceMap ITKImageGrid ITKIOMeshVTK
  ITKIOTransformHDF5 ITKIOTransformInsightLegacy ITKRegionGrowing ITKSmoothing ITKThresholding)
# ITK without its use-file, which would put its headers and factories into every target: readers are registered by name.
add_library(birdseye_itk INTERFACE)
target_include_directories(birdseye_itk SYSTEM INTERFACE ${ITK_INCLUDE_DIRS})
# Its own copy of Eigen and ours cannot meet in one file.
target_compile_definitions(birdseye_itk INTERFACE ITK_USE_SYSTEM_EIGEN)
target_compile_options(birdseye_itk INTERFACE
  "$<$<CXX_COMPILER_ID:Clang>:SHELL:-include ${CMAKE_SOURCE_DIR}/cmake/itk_with_clang.h>")
target_link_libraries(birdseye_itk INTERFACE ${ITK_LIBRARIES})
# DICOM files: DCMTK, and of GDCM the JPEG 2000 that Debian's DCMTK does not decode.
find_package(DCMTK REQUIRED)
add_library(birdseye_dcmtk INTERFACE)
target_include_directories(birdseye_dcmtk SYSTEM INTERFACE ${DCMTK_INCLUDE_DIRS})
target_link_libraries(birdseye_dcmtk INTERFACE DCMTK::dcmjpls DCMTK::dcmjpeg DCMTK::dcmdata)
# Not by its package file, which asks for parts that Debian packs elsewhere.
find_path(GDCM_INCLUDE_DIR gdcmJPEG2000Codec.h PATH_SUFFIXES gdcm-3.0 REQUIRED)
find_library(GDCM_MSFF_LIBRARY gdcmMSFF REQUIRED)
find_library(GDCM_DSED_LIBRARY gdcmDSED REQUIRED)
find_library(GDCM_COMMON_LIBRARY gdcmCommon REQUIRED)
add_library(birdseye_gdcm INTERFACE)
target_include_directories(birdseye_gdcm SYSTEM INTERFACE ${GDCM_INCLUDE_DIR})
target_link_libraries(birdseye_gdcm INTERFACE ${GDCM_MSFF_LIBRARY} ${GDCM_DSED_LIBRARY} ${GDCM_COMMON_LIBRARY})
