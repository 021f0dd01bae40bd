# The header of CSDP (Debian: libsdp-dev). The library itself is loaded at run time.
#
#   CSDP_FOUND  CSDP_INCLUDE_DIR

find_path(CSDP_INCLUDE_DIR csdp/declarations.h)
mark_as_advanced(CSDP_INCLUDE_DIR)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(CSDP REQUIRED_VARS CSDP_INCLUDE_DIR)
