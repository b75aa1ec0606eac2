typedef int placeholder_plane_vessel;
