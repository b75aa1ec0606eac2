typedef int placeholder_phantom;
