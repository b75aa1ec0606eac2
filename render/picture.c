typedef int placeholder_picture;
