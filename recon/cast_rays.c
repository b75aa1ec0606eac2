typedef int placeholder_cast_rays;
