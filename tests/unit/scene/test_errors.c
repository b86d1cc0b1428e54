/* Every code of SCENE section 8 that a scene document can earn, with the value
 * it names; and the fixes, which must mend what they are offered for. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/unit/scene/documents.h"

#define BALL           "'objects':[{'type':'sphere'}]"
#define OBJECT(fields) "{'objects':[{" fields "}]}"
#define TRIPLE         "[[0,0,0],[1,0,0],[0,1,0]]"

struct row {
    const char *text;
    const char *errors; /* "code pointer\n" each, in document order */
};

static const struct row rows[] = {
    /* the document */
    {"[]", "type.mismatch \n"},
    {"{}", "property.missing \n"},
    {"{'objects':[]}", "array.length /objects\n"},
    {"{'objects':{}}", "type.mismatch /objects\n"},
    {"{'objects':[3]}", "type.mismatch /objects/0\n"},
    {"{'version':2," BALL "}", "number.too_large /version\n"},
    {"{'version':'1'," BALL "}", "type.mismatch /version\n"},
    {"{'name':3," BALL "}", "type.mismatch /name\n"},
    {"{'time':0," BALL "}", "property.not_yet /time\n"},
    {"{'time':-1," BALL "}", "number.too_small /time\n"},
    {"{'extras':[]," BALL "}", "type.mismatch /extras\n"},
    {"{'definitions':[{'name':'d','type':'sphere'}]," BALL "}",
     "property.not_yet /definitions\n"},
    {"{'definitions':[{'type':'sphere','radius':-1}]," BALL "}",
     "property.missing /definitions/0\n"
     "number.too_small /definitions/0/radius\n"},
    {"{'assets':{'a':{'sha256':'00'}}," BALL "}",
     "string.pattern /assets/a/sha256\n"},
    {"{'assets':{'-':{}}," BALL "}",
     "string.pattern /assets/-\nproperty.missing /assets/-\n"},
    {"{'assets':{'a':{'sha256':'0123456789abcdef0123456789abcdef0123456789abcde"
     "f0123456789abcdef'}}," BALL "}",
     "property.not_yet /assets\n"},
    {"{'maxDepth':4," BALL "}", "property.unknown /maxDepth\n"},
    {"{'output':{}," BALL "}", "property.unknown /output\n"},

    /* camera */
    {"{'camera':3," BALL "}", "type.mismatch /camera\n"},
    {"{'camera':{'type':'fisheye'}," BALL "}", "enum.unknown /camera/type\n"},
    {"{'camera':{'type':'thin_lens'}," BALL "}", "enum.not_yet /camera/type\n"},
    {"{'camera':{'type':'thin_lens','aperture_radius':-1}," BALL "}",
     "number.too_small /camera/aperture_radius\n"},
    {"{'camera':{'near':0.1}," BALL "}", "property.not_yet /camera/near\n"},
    {"{'camera':{'fov':0}," BALL "}", "number.too_small /camera/fov\n"},
    {"{'camera':{'fov':180}," BALL "}", "number.too_large /camera/fov\n"},
    {"{'camera':{'fov':'45'}," BALL "}", "type.mismatch /camera/fov\n"},
    {"{'camera':{'fov_axis':'z'}," BALL "}", "enum.unknown /camera/fov_axis\n"},
    {"{'camera':{'focal_length':0}," BALL "}",
     "number.too_small /camera/focal_length\n"},
    {"{'camera':{'eye':[1,2]}," BALL "}", "array.length /camera/eye\n"},
    {"{'camera':{'eye':[1,2,null]}," BALL "}", "type.mismatch /camera/eye/2\n"},
    {"{'camera':{'eye':[1,2,2e6]}," BALL "}",
     "number.too_large /camera/eye/2\n"},
    {"{'camera':{'up':[0,0,0]}," BALL "}", "vector.zero /camera/up\n"},
    {"{'camera':{'eye':[1,1,1],'target':[1,1,1]}," BALL "}",
     "camera.degenerate /camera/target\n"},
    {"{'camera':{'target':[0,0,5]}," BALL "}",
     "camera.degenerate /camera/target\n"},
    {"{'camera':{'target':[0,0,0],'eye':[0,9,0]}," BALL "}",
     "camera.degenerate /camera/eye\n"},
    {"{'camera':{'up':[0,0,-2]}," BALL "}", "camera.degenerate /camera/up\n"},
    {"{'camera':{'window':[1,0,0,1]}," BALL "}",
     "geometry.degenerate /camera/window\n"},
    {"{'camera':{'window':[0,1,1,1]}," BALL "}",
     "geometry.degenerate /camera/window\n"},
    {"{'camera':{'distance':1}," BALL "}", "property.missing /camera\n"},
    {"{'camera':{'distance':1,'fov':45}," BALL "}",
     "property.conflict /camera/fov\n"},
    {"{'camera':{'window':[0,1,0,1],'fov':45,'focal_length':1}," BALL "}",
     "property.conflict /camera/fov\n"
     "property.conflict /camera/focal_length\n"},
    {"{'camera':{'type':'orthographic','height':1,'window':[0,1,0,1]}," BALL
     "}",
     "property.conflict /camera/window\n"},
    {"{'camera':{'type':'orthographic','fov':45}," BALL "}",
     "property.unknown /camera/fov\n"},

    /* film and sampler */
    {"{'film':{'width':0}," BALL "}", "number.too_small /film/width\n"},
    {"{'film':{'width':65536,'height':65536}," BALL "}",
     "number.too_large /film/width\nbudget.pixels /film/width\n"
     "number.too_large /film/height\n"},
    {"{'film':{'height':8192,'width':8192}," BALL "}",
     "budget.pixels /film/height\n"},
    {"{'film':{'width':1.5}," BALL "}", "number.not_integer /film/width\n"},
    {"{'film':{'crop':[0,0,1,1]}," BALL "}", "property.not_yet /film/crop\n"},
    {"{'film':{'crop':[0,0,1]}," BALL "}", "array.length /film/crop\n"},
    {"{'film':{'filter':{'type':'tent'}}," BALL "}",
     "enum.not_yet /film/filter/type\n"},
    {"{'film':{'filter':{'radius':2}}," BALL "}",
     "property.not_yet /film/filter/radius\n"},
    {"{'film':{'filter':{'radius':5}}," BALL "}",
     "number.too_large /film/filter/radius\n"},
    {"{'sampler':{'type':'independent'}," BALL "}",
     "enum.not_yet /sampler/type\n"},
    {"{'sampler':{'spp':16}," BALL "}", "sampler.center_spp /sampler/spp\n"},
    {"{'sampler':{'type':'center','spp':16}," BALL "}",
     "sampler.center_spp /sampler/type\n"},
    {"{'sampler':{'spp':16,'type':'center'}," BALL "}",
     "sampler.center_spp /sampler/spp\n"},
    {"{'sampler':{'type':'sobol','spp':0}," BALL "}",
     "number.too_small /sampler/spp\n"},
    {"{'sampler':{'seed':4294967296}," BALL "}",
     "number.too_large /sampler/seed\n"},
    {"{'sampler':{'target_error':0.1}," BALL "}",
     "property.not_yet /sampler/target_error\n"},
    {"{'sampler':{'type':'sobol','spp':65536},'film':{'width':4096,'height':"
     "4096}," BALL "}",
     "budget.rays /sampler/spp\n"},

    /* integrator and background */
    {"{'integrator':{'type':'path'}," BALL "}",
     "enum.not_yet /integrator/type\n"},
    {"{'integrator':{'type':'path','max_bounces':-1}," BALL "}",
     "number.too_small /integrator/max_bounces\n"},
    {"{'integrator':{'type':'path','russian_roulette':null,'clamp_indirect':1}"
     "," BALL "}",
     "enum.not_yet /integrator/type\n"
     "property.not_yet /integrator/clamp_indirect\n"},
    {"{'integrator':{'type':'ao','max_bounces':1}," BALL "}",
     "property.unknown /integrator/max_bounces\n"},
    {"{'integrator':{'light_sampling':'mis'}," BALL "}",
     "property.unknown /integrator/light_sampling\n"},
    {"{'integrator':{'max_bounces':2147483648}," BALL "}",
     "number.too_large /integrator/max_bounces\n"},
    {"{'integrator':{'clamp_local':0}," BALL "}",
     "number.too_small /integrator/clamp_local\n"},
    {"{'integrator':{'fresnel':{}}," BALL "}",
     "property.conflict /integrator/fresnel\n"},
    {"{'integrator':{'fresnel':{'power':2},'accumulation':'fresnel_weighted'}"
     "," BALL "}",
     "property.unknown /integrator/fresnel/power\n"},
    {"{'integrator':{'inside_hits':1}," BALL "}",
     "type.mismatch /integrator/inside_hits\n"},
    {"{'integrator':{'accumulation':'mean'},'materials':[{'name':'a','type':"
     "'mirror'},{'name':'b','type':'lambert'},{'name':'c','type':'glazed'}]"
     "," BALL "}",
     "integrator.material_unsupported /integrator/accumulation\n"},
    {"{'materials':[{'name':'a','type':'mirror'}],'integrator':{'accumulation':"
     "'fresnel_weighted'}," BALL "}",
     "integrator.material_unsupported /materials/0/type\n"},
    {"{'integrator':{'max_bounces':13},'materials':[{'name':'g','type':"
     "'dielectric'}]," BALL "}",
     "number.too_large /integrator/max_bounces\n"
     "enum.not_yet /materials/0/type\n"},
    {"{'background':{'type':'gradient','top':[0,0,0]}," BALL "}",
     "property.missing /background\n"},
    {"{'background':{'color':[0,0,-1]}," BALL "}",
     "number.too_small /background/color/2\n"},
    {"{'background':{'type':'image','asset':'sky'}," BALL "}",
     "reference.unknown /background/asset\n"},

    /* textures and materials */
    {"{'textures':[{'type':'checkerboard'}]," BALL "}",
     "property.missing /textures/0\n"},
    {"{'textures':[{'name':'t'}]," BALL "}", "property.missing /textures/0\n"},
    {"{'textures':[{'name':'t','type':'marble'}]," BALL "}",
     "enum.not_yet /textures/0/type\n"},
    {"{'textures':[{'name':'t','type':'marble','octaves':17}]," BALL "}",
     "number.too_large /textures/0/octaves\n"},
    {"{'textures':[{'name':'t','type':'checkerboard','scale':[1,2,3]}]," BALL
     "}",
     "array.length /textures/0/scale\n"},
    {"{'textures':[{'name':'t','type':'checkerboard','scale':[1,2],'mapping':"
     "'object_xyz'}]," BALL "}",
     "array.length /textures/0/scale\n"},
    {"{'textures':[{'name':'t','type':'checkerboard','color0':[0,0,1e7]}]," BALL
     "}",
     "number.too_large /textures/0/color0/2\n"},
    {"{'textures':[{'name':'t','type':'constant','color':[2,2,0]}],'objects':[{"
     "'type':'sphere','material':{'type':'lambert','diffuse':'t'}}]}",
     "number.too_large /textures/0/color/0\n"
     "number.too_large /textures/0/color/1\n"},
    {"{'textures':[{'name':'t','type':'constant','color':[2,2,0]}],'objects':[{"
     "'type':'sphere','material':{'type':'lambert','emission':'t'}}]}",
     ""},
    {OBJECT("'type':'sphere','material':{'type':'lambert','diffuse':{'type':"
            "'constant','color':[3,0,0]}}"),
     "number.too_large /objects/0/material/diffuse/color/0\n"},
    {OBJECT("'type':'sphere','material':{'type':'lambert','diffuse':0.5}"),
     "type.mismatch /objects/0/material/diffuse\n"},
    {OBJECT("'type':'sphere','material':{'type':'lambert','diffuse':[1,1]}"),
     "array.length /objects/0/material/diffuse\n"},
    {OBJECT("'type':'sphere','material':{'type':'lambert','diffuse':[1,2,0]}"),
     "number.too_large /objects/0/material/diffuse/1\n"},
    {OBJECT("'type':'sphere','material':{'type':'lambert','diffuse':'wood'}"),
     "reference.unknown /objects/0/material/diffuse\n"},
    {OBJECT("'type':'sphere','material':{'type':'mirror','diffuse':[1,1,1]}"),
     "property.unknown /objects/0/material/diffuse\n"},
    {OBJECT("'type':'sphere','material':7"),
     "type.mismatch /objects/0/material\n"},
    {OBJECT("'type':'sphere','material':{'type':'dielectric','ior':0.5}"),
     "number.too_small /objects/0/material/ior\n"},
    {"{'materials':[{'name':'a','type':'mix','a':'b','b':'b','weight':0.5},{"
     "'name':'b','type':'mix','a':'a','b':{'type':'lambert'},'weight':0.5}]"
     "," BALL "}",
     "enum.not_yet /materials/0/type\n"
     "enum.not_yet /materials/1/type\n"
     "reference.cycle /materials/1/a\n"},
    {"{'materials':[{'name':'a','type':'mix','a':'c','b':'a','weight':2}]," BALL
     "}",
     "reference.unknown /materials/0/a\n"
     "reference.cycle /materials/0/b\n"
     "number.too_large /materials/0/weight\n"},

    /* lights */
    {"{'lights':{}," BALL "}", "type.mismatch /lights\n"},
    {"{'lights':[{'type':'point'}]," BALL "}", "property.missing /lights/0\n"},
    {"{'lights':[{'type':'point','position':[0,0,0],'intensity':-1}]," BALL "}",
     "number.too_small /lights/0/intensity\n"},
    {"{'lights':[{'type':'directional'}]," BALL "}",
     "property.missing /lights/0\n"},
    {"{'lights':[{'type':'directional','to_light':[0,1,0],'direction':[0,1,0]}]"
     "," BALL "}",
     "property.conflict /lights/0/direction\n"},
    {"{'lights':[{'type':'directional','to_light':[0,1,0],'falloff':'none'}]"
     "," BALL "}",
     "property.unknown /lights/0/falloff\n"},
    {"{'lights':[{'type':'spot','position':[0,1,0],'target':[0,0,0],'inner':10,"
     "'outer':20}]," BALL "}",
     "enum.not_yet /lights/0/type\n"},
    {"{'lights':[{'type':'spot','position':[0,1,0],'target':[0,0,0],'inner':30,"
     "'outer':20}]," BALL "}",
     "geometry.degenerate /lights/0/inner\n"},
    {"{'lights':[{'type':'area_grid','position':[0,1,0],'samples':65}]," BALL
     "}",
     "number.too_large /lights/0/samples\n"},
    {"{'lights':[{'type':'point','position':[0,1,0],'name':'a'},{'type':'point'"
     ",'position':[0,1,0],'name':'a'}]," BALL "}",
     "name.duplicate /lights/1/name\n"},

    /* objects */
    {OBJECT("'radius':1"), "property.missing /objects/0\n"},
    {OBJECT("'type':7"), "type.mismatch /objects/0/type\n"},
    {OBJECT("'type':'sphere','radius':0"),
     "number.too_small /objects/0/radius\n"},
    {OBJECT("'type':'sphere','radius':1e-320"),
     "number.too_small /objects/0/radius\n"},
    {OBJECT("'type':'sphere','radius':1e7"),
     "number.too_large /objects/0/radius\n"},
    {OBJECT("'type':'sphere','raduis':1"),
     "property.unknown /objects/0/raduis\n"},
    {OBJECT("'type':'sphere','major_radius':1"),
     "property.unknown /objects/0/major_radius\n"},
    {OBJECT("'type':'sphere','name':'../x'"),
     "string.pattern /objects/0/name\n"},
    {OBJECT("'type':'sphere','name':''"), "string.pattern /objects/0/name\n"},
    {OBJECT("'type':'sphere','visible':{'camera':0}"),
     "type.mismatch /objects/0/visible/camera\n"},
    {OBJECT("'type':'sphere','visible':{'shadows':true}"),
     "property.unknown /objects/0/visible/shadows\n"},
    {OBJECT("'type':'torus','major_radius':2,'minor_radius':1"),
     "enum.not_yet /objects/0/type\n"},
    {OBJECT("'type':'torus','minor_radius':2,'major_radius':1"),
     "geometry.degenerate /objects/0/minor_radius\n"},
    {OBJECT("'type':'box','min':[0,0,0],'max':[1,0,1]"),
     "geometry.degenerate /objects/0/min\n"},
    {OBJECT("'type':'plane','normal':[0,0,0]"),
     "vector.zero /objects/0/normal\n"},
    {OBJECT("'type':'plane','offset':1,'point':[0,0,0]"),
     "property.conflict /objects/0/point\n"},
    {OBJECT("'type':'plane','normal':[1e-9,0,0],'offset':1"),
     "number.too_large /objects/0/normal\n"},
    {OBJECT("'type':'triangle','vertices':[[0,0,0],[1,0,0]]"),
     "array.length /objects/0/vertices\n"},
    {OBJECT("'type':'triangle','vertices':[[0,0,0],[1,0,0],[1]]"),
     "array.length /objects/0/vertices/2\n"},
    {OBJECT("'type':'triangle','vertices':" TRIPLE ",'normals':" TRIPLE),
     "vector.zero /objects/0/normals/0\n"},
    {OBJECT("'type':'quad','origin':[0,0,0],'edge_u':[0,0,0],'edge_v':[1,0,0]"),
     "vector.zero /objects/0/edge_u\n"},
    {OBJECT("'type':'quad','origin':[0,0,0],'edge_v':[2,0,0],'edge_u':[1,0,0]"),
     "geometry.degenerate /objects/0/edge_v\n"},
    {OBJECT("'type':'disk','center':[0,0,0],'normal':[0,1,0],'radius':1,"
            "'inner_radius':1"),
     "geometry.degenerate /objects/0/radius\n"},
    {OBJECT("'type':'cylinder','from':[0,0,0],'to':[0,0,0],'radius':1"),
     "geometry.degenerate /objects/0/from\n"},
    {OBJECT("'type':'cone','from':[0,0,0],'to':[0,1,0],'radius':1,'radius_to':"
            "-1"),
     "number.too_small /objects/0/radius_to\n"},
    {"{'objects':[{'type':'group','children':[]}]}",
     "array.length /objects/0/children\n"},
    {"{'objects':[{'type':'group','name':'a','children':[{'type':'sphere',"
     "'name':'b'}]},{'type':'sphere','name':'a'},{'type':'sphere','name':'b'}]"
     "}",
     "name.duplicate /objects/1/name\nname.duplicate /objects/2/name\n"},

    /* meshes */
    {OBJECT("'type':'mesh'"),
     "property.missing /objects/0\nproperty.missing /objects/0\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE),
     "property.missing /objects/0\n"},
    {OBJECT("'type':'mesh','positions':[0,0,0,1,0,0],'indices':[[0,1,2]]"),
     "type.mismatch /objects/0/positions/0\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE ",'indices':[0,1,2]"),
     "type.mismatch /objects/0/indices/0\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE ",'indices':[[0,1,2],[0,1]]"),
     "array.length /objects/0/indices/1\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE ",'indices':[[0,1,-1]]"),
     "number.too_small /objects/0/indices/0/2\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE ",'indices':[[0,1,1.5]]"),
     "number.not_integer /objects/0/indices/0/2\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE ",'indices':[[0,1,3]]"),
     "mesh.index_range /objects/0/indices/0/2\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE ",'indices':[]"),
     "array.length /objects/0/indices\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE
            ",'indices':[[0,1,2]],'normals':[[0,0,1]]"),
     "array.length /objects/0/normals\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE
            ",'indices':[[0,1,2]],'uvs':[[0,0],[1,0],[1,1],[0,1]]"),
     "array.length /objects/0/uvs\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE
            ",'indices':[[0,1,2]],'normals':[[0,0,1],[0,0,1],[0,0,0]]"),
     "vector.zero /objects/0/normals/2\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE
            ",'indices':[[0,1,2]],'smooth':true"),
     "property.missing /objects/0\n"},
    {OBJECT("'type':'mesh','positions':" TRIPLE
            ",'indices':[[0,1,2]],'asset':'a'"),
     "reference.unknown /objects/0/asset\n"
     "property.conflict /objects/0/asset\n"},

    /* transforms */
    {OBJECT("'type':'sphere','transform':{}"),
     "type.mismatch /objects/0/transform\n"},
    {OBJECT("'type':'sphere','transform':[{}]"),
     "property.missing /objects/0/transform/0\n"},
    {OBJECT("'type':'sphere','transform':[{'scale':1,'translate':[0,0,0]}]"),
     "property.conflict /objects/0/transform/0/translate\n"},
    {OBJECT("'type':'sphere','transform':[{'skew':1}]"),
     "property.unknown /objects/0/transform/0/skew\n"},
    {OBJECT("'type':'sphere','transform':[{'scale':[1,0,1]}]"),
     "transform.singular /objects/0/transform/0/scale/1\n"},
    {OBJECT("'type':'sphere','transform':[{'scale':0}]"),
     "transform.singular /objects/0/transform/0/scale\n"},
    {OBJECT("'type':'sphere','transform':[{'scale':[1,1]}]"),
     "array.length /objects/0/transform/0/scale\n"},
    {OBJECT("'type':'sphere','transform':[{'rotate':{'axis':[0,0,0],'angle':1}}"
            "]"),
     "vector.zero /objects/0/transform/0/rotate/axis\n"},
    {OBJECT("'type':'sphere','transform':[{'rotate':{'axis':[0,0,1]}}]"),
     "property.missing /objects/0/transform/0/rotate\n"},
    {OBJECT("'type':'sphere','transform':[{'matrix':[1,0,0,0,2,0,0,0,0,0,1,0,0,"
            "0,0,1]}]"),
     "transform.singular /objects/0/transform/0/matrix\n"},
    {OBJECT("'type':'sphere','transform':[{'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,5,"
            "0,0,0]}]"),
     "number.too_large /objects/0/transform/0/matrix/12\n"
     "number.too_small /objects/0/transform/0/matrix/15\n"},
    {OBJECT("'type':'sphere','transform':[{'matrix':[1,0,0]}]"),
     "array.length /objects/0/transform/0/matrix\n"},
    {OBJECT("'type':'sphere','transform':[{'scale':1e6},{'scale':1e6}]"),
     "number.too_large /objects/0/transform\n"},
    {OBJECT("'type':'group','transform':[{'scale':[1,1,1e-6]}],'children':[{"
            "'type':'sphere','transform':[{'rotate':{'axis':[0,1,0],'angle':45}"
            "},{'scale':[1,1,1e-6]},{'rotate':{'axis':[0,1,0],'angle':45}}]}]"),
     "transform.singular /objects/0/children/0/transform\n"},
    {OBJECT("'type':'sphere','transform':[{'bounce':{'height':1,'period':1}}]"),
     "property.not_yet /objects/0/transform/0/bounce\n"},
    {OBJECT("'type':'sphere','transform':[{'bounce':{'height':1,'period':0}}]"),
     "number.too_small /objects/0/transform/0/bounce/period\n"},

    /* csg, instances, distance fields */
    {OBJECT("'type':'csg','operation':'union','left':{'type':'sphere'},'right':"
            "{'type':'box','min':[0,0,0],'max':[1,1,1]}"),
     "enum.not_yet /objects/0/type\n"},
    {OBJECT("'type':'csg','operation':'union','left':{'type':'plane'},'right':{"
            "'type':'sphere'}"),
     "csg.open_operand /objects/0/left/type\n"},
    {OBJECT("'type':'csg','operation':'minus','left':{'type':'sphere'}"),
     "property.missing /objects/0\nenum.unknown /objects/0/operation\n"},
    {OBJECT("'type':'instance','of':'tree'"),
     "reference.unknown /objects/0/of\n"},
    {"{'definitions':[{'name':'a','type':'instance','of':'a'}]," BALL "}",
     "property.not_yet /definitions\nenum.not_yet /definitions/0/type\n"
     "reference.cycle /definitions/0/of\n"},
    {OBJECT("'type':'sdf','root':{'type':'sphere','radius':1}"),
     "enum.not_yet /objects/0/type\n"},
    {OBJECT("'type':'sdf','root':{'type':'blob'}"),
     "enum.unknown /objects/0/root/type\n"},
    {OBJECT("'type':'sdf','march':{'max_steps':0},'root':{'type':'union',"
            "'children':[]}"),
     "number.too_small /objects/0/march/max_steps\n"
     "array.length /objects/0/root/children\n"},
    {OBJECT("'type':'sdf','root':{'type':'sphere','radius':1,'transform':[{"
            "'scale':[1,2,1]}]}"),
     "transform.not_uniform /objects/0/root/transform\n"},
    {OBJECT("'type':'sdf','root':{'type':'repeat','period':[1,0,1],'child':{"
            "'type':'sphere','radius':1}}"),
     "enum.not_yet /objects/0/type\nenum.not_yet /objects/0/root/type\n"},
};

static void
list_errors(const struct document *d, struct bytes *out)
{
    bytes_append(out, "", 0);
    for (size_t i = 0; i < d->errors.count; i++)
        bytes_printf(out, "%s %s\n", error_code_name(d->errors.items[i].code),
                     d->errors.items[i].pointer ? d->errors.items[i].pointer
                                                : "null");
}

static void
each_document_earns_its_codes(void **unused)
{
    int wrong = 0;
    (void)unused;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct document d;
        struct bytes said = {0};
        document_quoted(&d, rows[i].text);
        list_errors(&d, &said);
        if (strcmp(said.data, rows[i].errors) != 0) {
            print_error("%s\nexpected:\n%sgot:\n%s", rows[i].text,
                        rows[i].errors, said.data);
            wrong++;
        }
        assert_int_equal(d.good, d.errors.count == 0);
        bytes_clear(&said);
        document_clear(&d);
    }
    assert_int_equal(wrong, 0);
}

static bool
has_error(const struct document *d, const struct error_item *e)
{
    for (size_t i = 0; i < d->errors.count; i++) {
        const struct error_item *o = &d->errors.items[i];
        if (o->code == e->code && o->pointer != NULL &&
            strcmp(o->pointer, e->pointer) == 0)
            return true;
    }
    return false;
}

static void
fixes_mend(void **unused)
{
    static const char *const more[] = {
        OBJECT("'type':'sphear'"),
        OBJECT("'type':'sphere','raduis':2,'centre':[0,0,0]"),
        "{'materials':[{'name':'gold','type':'lambert'}],'objects':[{'type':"
        "'sphere','material':'golt'}]}",
        "{'integrator':{'acumulation':'maen'}," BALL "}",
        "{'camera':{'fov_axes':'x','fov':45,'focal_length':2}," BALL "}",
    };
    size_t fixes = 0, count = sizeof rows / sizeof rows[0];
    (void)unused;
    for (size_t i = 0; i < count + sizeof more / sizeof more[0]; i++) {
        struct document d;
        document_quoted(&d, i < count ? rows[i].text : more[i - count]);
        for (size_t k = 0; k < d.errors.count; k++) {
            const struct error_item *e = &d.errors.items[k];
            struct document mended;
            struct bytes text = {0};
            if (e->fix == NULL)
                continue;
            fixes++;
            if (!patch_apply(d.text.data, d.text.len, e->fix, &text))
                fail_msg("%s: %s", d.text.data, e->fix);
            document_read(&mended, text.data, text.len, NULL);
            if (mended.root == NULL || has_error(&mended, e))
                fail_msg("%s\nfix %s\ngives %s", d.text.data, e->fix,
                         text.data);
            bytes_clear(&text);
            document_clear(&mended);
        }
        document_clear(&d);
    }
    assert_true(fixes >= 15);
}

static const struct error_item *
only_error(struct document *d, const char *text)
{
    document_quoted(d, text);
    assert_int_equal(d->errors.count, 1);
    return &d->errors.items[0];
}

static void
hints_help(void **unused)
{
    static const char *const pairs[][2] = {
        {"{'integrator':{'maxDepth':4}," BALL "}",
         "the lecture's maxDepth 4 is max_bounces 3"},
        {"{'integrator':{'max_depth':4}," BALL "}",
         "the lecture's maxDepth 4 is max_bounces 3"},
        {"{'integrator':{'depth':4}," BALL "}",
         "the lecture's maxDepth 4 is max_bounces 3"},
        {"{'output':{}," BALL "}", "job"},
        {"{'integrator':{'type':'ao','accumulation':'mean'}," BALL "}",
         "whitted"},
        {OBJECT("'type':'sphere','raduis':1"), "radius"},
        {OBJECT("'type':'torus','major_radius':2,'minor_radius':1"), "sphere"},
        {"{'integrator':{'accumulation':'average'}," BALL "}", "mean"},
        {"{'objects':[{'type':'sphere','material':'x'}]}", "names no material"},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        struct document d;
        const struct error_item *e = only_error(&d, pairs[i][0]);
        if (e->hint == NULL || strstr(e->hint, pairs[i][1]) == NULL)
            fail_msg("%s: %s", pairs[i][0], e->hint ? e->hint : "no hint");
        document_clear(&d);
    }
}

static void
details_name_the_value(void **unused)
{
    static const char *const pairs[][2] = {
        {OBJECT("'type':'sphere','radius':-1"),
         "must be greater than 0, got -1"},
        {OBJECT("'type':'sphere','radius':'2'"),
         "must be a number, got the string \"2\""},
        {OBJECT("'type':'box','min':[0,0,0]"), "a `box` needs `max`"},
        {OBJECT("'type':'box','min':[2,0,0],'max':[1,1,1]"),
         "min.x 2 is not less than max.x 1"},
        {"{'sampler':{'type':'center','spp':16}," BALL "}",
         "`center` takes one sample per pixel, got 16"},
        {"{'camera':{'fov':45,'focal_length':1}," BALL "}",
         "give `fov` or `focal_length`, not both"},
        {OBJECT("'type':'mesh','positions':" TRIPLE ",'indices':[[0,1,7]]"),
         "index 7, but there are 3 positions"},
        {"{'integrator':{'max_bounces':99}," BALL "}",
         "must be at most 64, got 99"},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        struct document d;
        assert_string_equal(only_error(&d, pairs[i][0])->detail, pairs[i][1]);
        document_clear(&d);
    }
}

/* A text of `count` copies between a head and a tail. */
static void
repeated(struct bytes *out, const char *head, const char *copy, size_t count,
         const char *tail)
{
    bytes_text(out, head);
    for (size_t i = 0; i < count; i++) {
        if (i > 0)
            bytes_text(out, ",");
        bytes_text(out, copy);
    }
    bytes_text(out, tail);
}

static void
check_budget(const char *head, const char *copy, size_t count, const char *tail,
             const char *errors)
{
    struct document d;
    struct bytes text = {0}, said = {0};
    repeated(&text, head, copy, count, tail);
    document_quoted(&d, text.data);
    list_errors(&d, &said);
    assert_string_equal(said.data, errors);
    document_clear(&d);
    bytes_clear(&text);
    bytes_clear(&said);
}

static void
budgets_hold(void **unused)
{
    (void)unused;
    check_budget("{'objects':[", "{'type':'sphere'}", 10000, "]}", "");
    check_budget("{'objects':[", "{'type':'sphere'}", 10001, "]}",
                 "budget.objects /objects\n");
    check_budget("{'objects':[{'type':'group','children':[",
                 "{'type':'sphere'}", 10001, "]}]}",
                 "budget.objects /objects\n");
    check_budget("{'objects':[{'type':'mesh','positions':" TRIPLE
                 ",'indices':[",
                 "[0,1,2]", 20000, "]}]}", "");
    check_budget(
        "{'objects':[{'type':'mesh','positions':" TRIPLE ",'indices':[",
        "[0,1,2]", 20001, "]}]}", "budget.triangles /objects/0/indices\n");
    check_budget("{" BALL ",'lights':[", "{'type':'point','position':[0,0,0]}",
                 257, "]}", "budget.list /lights\n");
    check_budget("{" BALL ",'materials':[", "{}", 1025, "]}",
                 "budget.list /materials\n");
    check_budget("{" BALL ",'textures':[", "{}", 1025, "]}",
                 "budget.list /textures\n");
    check_budget("{" BALL ",'extras':{'a':[", "'0123456789'", 1300, "]}}",
                 "budget.bytes /extras\n");
    check_budget("{" BALL ",'name':'", "0123456789", 6, "'}",
                 "string.length /name\n");
    check_budget("{" BALL ",'description':'", "é", 2049, "'}",
                 "string.length /description\n");
    check_budget("{" BALL ",'description':'", "é", 2048, "'}", "");
}

static void
nest(struct bytes *out, int depth)
{
    bytes_text(out, "{'objects':[");
    for (int i = 0; i < depth; i++)
        bytes_text(out, "{'type':'group','children':[");
    bytes_text(out, "{'type':'sphere'}");
    for (int i = 0; i < depth; i++)
        bytes_text(out, "]}");
    bytes_text(out, "]}");
}

static void
groups_nest_eight_deep(void **unused)
{
    struct document d;
    struct bytes text = {0};
    (void)unused;
    nest(&text, 8);
    document_quoted(&d, text.data);
    assert_true(d.good);
    assert_int_equal(d.scene.object_count, 1);
    document_clear(&d);
    bytes_clear(&text);
    nest(&text, 9);
    document_quoted(&d, text.data);
    assert_false(d.good);
    assert_int_equal(d.errors.items[0].code, ERROR_BUDGET_DEPTH);
    document_clear(&d);
    bytes_clear(&text);
}

static void
operators_lower_limits(void **unused)
{
    static const char text[] =
        "{\"film\":{\"width\":200,\"height\":200},\"sampler\":{\"type\":"
        "\"sobol\",\"spp\":64},\"integrator\":{\"max_bounces\":9},\"objects\":"
        "[{\"type\":\"sphere\"}]}";
    const struct {
        struct scene_limits limits;
        const char *errors;
    } cases[] = {
        {{0}, ""},
        {{.max_pixels = 100}, "budget.pixels /film/width\n"},
        {{.max_spp = 16}, "number.too_large /sampler/spp\n"},
        {{.max_bounces = 8}, "number.too_large /integrator/max_bounces\n"},
        {{.max_rays = 1000}, "budget.rays /film/width\n"},
    };
    (void)unused;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct document d;
        struct bytes said = {0};
        document_read(&d, text, strlen(text), &cases[i].limits);
        list_errors(&d, &said);
        assert_string_equal(said.data, cases[i].errors);
        bytes_clear(&said);
        document_clear(&d);
    }
}

/* The first fifty in document order, and a word that there are more. */
static void
fifty_errors_are_told(void **unused)
{
    struct document d;
    struct bytes text = {0};
    (void)unused;
    repeated(&text, "{'nonsense':1,'objects':[", "{'type':'sphere','radius':0}",
             300, "],'camera':{'fov':0}}");
    document_quoted(&d, text.data);
    assert_int_equal(d.errors.count, 50);
    assert_true(d.errors.truncated);
    assert_string_equal(d.errors.items[0].pointer, "/nonsense");
    assert_string_equal(d.errors.items[49].pointer, "/objects/48/radius");
    document_clear(&d);
    bytes_clear(&text);
}

int
main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_document_earns_its_codes),
        cmocka_unit_test(fixes_mend),
        cmocka_unit_test(hints_help),
        cmocka_unit_test(details_name_the_value),
        cmocka_unit_test(budgets_hold),
        cmocka_unit_test(groups_nest_eight_deep),
        cmocka_unit_test(operators_lower_limits),
        cmocka_unit_test(fifty_errors_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
